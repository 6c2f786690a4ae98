"""A network by name with settings from the command line."""

from collections.abc import Sequence
from typing import Any

from kinverse.errors import InputError
from kinverse.networks import make_network

__all__ = ["changed", "network", "value"]

NOT_HERE = {"callback", "random_state", "warm_start"}
"""Settings of a session in Python; the seed is an option of its own."""
WORDS = {"none": None, "true": True, "false": False}


def network(name: str, settings: Sequence[str]) -> Any:
    """A network that is not fitted.

    Args:
        name: "mlp", "rbfnetwork" ... in any case.
        settings: "name=value" each.

    Raises:
        InputError: an unknown network or setting, or one that is given twice; the valid ones are
            named.
        MissingExtra: scikit-learn is not installed.
    """
    return make_network(name, **_settings(make_network(name), settings))


def changed(made: Any, settings: Sequence[str]) -> Any:
    """A network that is not fitted with settings changed; raises as ``network`` does."""
    return made.set_params(**_settings(made, settings))


def _settings(made: Any, settings: Sequence[str]) -> dict[str, Any]:
    title, valid = type(made).__name__, [key for key in made.get_params(deep=False)]
    valid = [key for key in valid if key not in NOT_HERE]
    given: dict[str, Any] = {}
    for setting in settings:
        key, sign, text = (part.strip() for part in setting.partition("="))
        if not sign or not key or not text:
            raise InputError(
                f"--set needs name=value, such as --set {_example(made, valid)}; got {setting!r}"
            )
        if key not in valid:
            raise InputError(f"{title} has no setting {key!r}: its settings are {', '.join(valid)}")
        if key in given:
            raise InputError(f"--set {key} is given twice")
        given[key] = value(text)
    return given


def _example(made: Any, valid: Sequence[str]) -> str:
    """The first setting that has a value, with it."""
    for key in valid:
        given = getattr(made, key)
        if given is not None:
            values = given if isinstance(given, (tuple, list)) else [given]
            return f"{key}={','.join(map(str, values))}"
    return f"{valid[0]}=none"


def value(text: str) -> Any:
    """None, a bool, an int, a float or text; several with commas between them are a tuple.

    Example:
        >>> value("60,60"), value("lm"), value("none"), value("1e-3")
        ((60, 60), 'lm', None, 0.001)
    """
    if "," in text:
        return tuple(value(part.strip()) for part in text.split(",") if part.strip())
    if text.lower() in WORDS:
        return WORDS[text.lower()]
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            pass
    return text
