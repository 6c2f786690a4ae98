"""A number that counts what is done with it, so that no table of operations is made by hand."""

import math
from dataclasses import dataclass
from typing import Any

__all__ = ["Counted", "Number", "Tally", "atan2", "cos", "sin", "sqrt"]

Number = Any
"""A float, a :class:`Counted`, or a plain int where a 0 or +-1 belongs to the structure."""


@dataclass
class Tally:
    """Operations done by the numbers that share it.

    Attributes:
        additions: sums and differences.
        multiplications: products.
        divisions: quotients.
        square_roots: square roots.
        sines: sines and cosines.
        arctangents: two-argument arctangents.
    """

    additions: int = 0
    multiplications: int = 0
    divisions: int = 0
    square_roots: int = 0
    sines: int = 0
    arctangents: int = 0


class Counted:
    """A real number whose arithmetic is tallied.

    A change of sign is free, and so is an operation with a plain int 0, 1 or -1: such entries are
    known when the formulas are written, and nobody computes with them. Comparisons are free.

    Example:
        >>> tally = Tally()
        >>> x = Counted(3.0, tally)
        >>> float(x * x + 1.5), tally.additions, tally.multiplications
        (10.5, 1, 1)
    """

    __slots__ = ("tally", "value")

    def __init__(self, value: float, tally: Tally) -> None:
        self.value = float(value)
        self.tally = tally

    def _made(self, value: float) -> "Counted":
        return Counted(value, self.tally)

    def __float__(self) -> float:
        return self.value

    def __repr__(self) -> str:
        return f"Counted({self.value!r})"

    def __lt__(self, other: Number) -> bool:
        return self.value < float(other)

    def __gt__(self, other: Number) -> bool:
        return self.value > float(other)

    def __neg__(self) -> "Counted":
        return self._made(-self.value)

    def __abs__(self) -> "Counted":
        return self._made(abs(self.value))

    def __add__(self, other: Number) -> "Counted":
        if _known(other, 0):
            return self
        self.tally.additions += 1
        return self._made(self.value + float(other))

    __radd__ = __add__

    def __sub__(self, other: Number) -> "Counted":
        return self.__add__(-other)

    def __rsub__(self, other: Number) -> "Counted":
        return self.__neg__().__add__(other)

    def __mul__(self, other: Number) -> Number:
        if _known(other, 0):
            return 0
        if _known(other, 1):
            return self
        if _known(other, -1):
            return -self
        self.tally.multiplications += 1
        return self._made(self.value * float(other))

    __rmul__ = __mul__

    def __truediv__(self, other: Number) -> "Counted":
        self.tally.divisions += 1
        return self._made(self.value / float(other))

    def sqrt(self) -> "Counted":
        """The square root, tallied."""
        self.tally.square_roots += 1
        return self._made(math.sqrt(self.value))

    def sin(self) -> "Counted":
        """The sine, tallied."""
        self.tally.sines += 1
        return self._made(math.sin(self.value))

    def cos(self) -> "Counted":
        """The cosine, tallied."""
        self.tally.sines += 1
        return self._made(math.cos(self.value))

    def atan2(self, x: Number) -> "Counted":
        """The angle of (x, self), tallied."""
        self.tally.arctangents += 1
        return self._made(math.atan2(self.value, float(x)))


def _known(number: Number, value: int) -> bool:
    return type(number) is int and number == value


def sqrt(x: Number) -> Number:
    """Square root of a number of any of the types."""
    return x.sqrt() if isinstance(x, Counted) else math.sqrt(x)


def sin(x: Number) -> Number:
    """Sine of a number of any of the types [rad]."""
    return x.sin() if isinstance(x, Counted) else math.sin(x)


def cos(x: Number) -> Number:
    """Cosine of a number of any of the types [rad]."""
    return x.cos() if isinstance(x, Counted) else math.cos(x)


def atan2(y: Number, x: Number) -> Number:
    """Angle [rad] of the point (x, y), numbers of any of the types."""
    if isinstance(y, Counted):
        return y.atan2(x)
    if isinstance(x, Counted):
        return Counted(float(y), x.tally).atan2(x)
    return math.atan2(y, x)
