"""How the damping mu of a Levenberg-Marquardt step follows its success."""

from collections.abc import Callable
from typing import Protocol

from kinverse.errors import InputError

__all__ = ["DAMPINGS", "MOST_DAMPING", "Damping", "Nielsen", "Tenfold", "make_damping"]

LEAST_DAMPING, MOST_DAMPING = 1e-20, 1e10


class Damping(Protocol):
    """The number added to the diagonal of J^T J."""

    mu: float

    def accept(self, ratio: float) -> None:
        """A step was taken; ratio is its gain over what the quadratic model promised."""
        ...

    def refuse(self) -> None:
        """A step was not taken: the next is shorter."""
        ...


class Tenfold:
    """A tenth after a step that is taken, ten times after one that is not (trainlm)."""

    def __init__(self, mu: float) -> None:
        self.mu = mu

    def accept(self, ratio: float) -> None:
        """A tenth, whatever the gain."""
        self.mu = max(0.1 * self.mu, LEAST_DAMPING)

    def refuse(self) -> None:
        """Ten times."""
        self.mu *= 10.0


class Nielsen:
    """Nielsen (1999): the better the model, the less; doubled factors while steps are refused."""

    def __init__(self, mu: float) -> None:
        self.mu, self._growth = mu, 2.0

    def accept(self, ratio: float) -> None:
        """Down to a third where the model was right, up where it promised too much."""
        self.mu = max(self.mu * max(1.0 / 3.0, 1.0 - (2.0 * ratio - 1.0) ** 3), LEAST_DAMPING)
        self._growth = 2.0

    def refuse(self) -> None:
        """Twice, then four times, eight times ..."""
        self.mu, self._growth = self.mu * self._growth, self._growth * 2.0


DAMPINGS: dict[str, Callable[[float], Damping]] = {"tenfold": Tenfold, "nielsen": Nielsen}
"""By the name that ``MLP(damping=...)`` takes."""


def make_damping(name: str, mu: float) -> Damping:
    """A rule by its name, beginning with mu.

    Raises:
        InputError: an unknown name; the message lists the names.
    """
    if not isinstance(name, str) or name not in DAMPINGS:
        raise InputError(f"damping must be {' or '.join(map(repr, DAMPINGS))}, got {name!r}")
    return DAMPINGS[name](mu)
