"""Models by name, for the command line and for files of settings."""

from typing import Any

from kinverse.calibration.fourier import FourierErrorModel
from kinverse.calibration.geometric import GeometricErrorModel
from kinverse.calibration.polynomial import BASES, PolynomialErrorModel
from kinverse.calibration.stack import Stack
from kinverse.calibration.zero import ZeroErrorModel
from kinverse.errors import InputError
from kinverse.robot import Robot

__all__ = ["CANDIDATES", "make_model"]

CANDIDATES = (
    "fourier:1",
    "fourier:2",
    "polynomial:2",
    "polynomial:4",
    "geometric",
    "geometric:2",
    "geometric+fourier:2",
    "geometric+polynomial:4",
    "geometric:2+fourier:2",
)
"""What is compared where nothing is named."""

FORMS = "none, fourier:HARMONICS, polynomial:DEGREE[:BASIS], geometric[:HARMONICS], joined by +"


def make_model(text: str, robot: Robot) -> Any:
    """The model a text names, not fitted.

    Args:
        text: "none", "fourier:2", "polynomial:3", "polynomial:3:legendre", "geometric",
            "geometric:2" (with gear errors of two harmonics), or several joined by "+": a stack.
        robot: what geometric models correct.

    Raises:
        InputError: something else; the message lists the forms.

    Example:
        >>> make_model("geometric+fourier:2", robot)
    """
    parts = [part.strip() for part in text.split("+")] if isinstance(text, str) else []
    models = [_one(part, robot) for part in parts]
    if not models or None in models:
        raise InputError(f"unknown error model {text!r}: it must be {FORMS}")
    return models[0] if len(models) == 1 else Stack(models)


def _one(text: str, robot: Robot) -> Any:
    """None where the text names no model."""
    name, *words = text.split(":")
    basis = words.pop() if len(words) == 2 and name == "polynomial" else None
    if len(words) > 1 or not all(word.isdecimal() for word in words):
        return None
    if basis is not None and basis not in BASES:
        raise InputError(f"polynomial basis must be one of {', '.join(BASES)}, got {basis!r}")
    count = int(words[0]) if words else None
    if name == "none" and count is None:
        return ZeroErrorModel()
    if name == "geometric":
        return GeometricErrorModel(robot, harmonics=count or 0)
    if name == "fourier" and count is not None:
        return FourierErrorModel(count)
    if name == "polynomial" and count is not None:
        return PolynomialErrorModel(count, basis or "power")
    return None
