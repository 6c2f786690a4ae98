"""Matrix, quaternion-vector pair and dual quaternion in plain Python, over any number type.

Written once each, entry by entry, so that a counting number sees what the formulas ask for. Fast
arrays of the same are :mod:`kinverse.pairs` and :mod:`kinverse.dual_quaternion`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.studies.counted import Number, cos, sin

__all__ = ["FORMS", "AnyForm", "Dual", "Lift", "Matrix", "Numbers", "Pair"]

Numbers = tuple[Number, ...]
Lift = Callable[[Number], Number]

UNIT: tuple[Numbers, ...] = ((1, 0, 0), (0, 1, 0), (0, 0, 1))


@dataclass(frozen=True)
class Matrix:
    """Rotation matrix and translation: 12 numbers of the homogeneous matrix."""

    R: tuple[Numbers, Numbers, Numbers]
    p: Numbers
    name: ClassVar[str] = "matrix"
    scalars: ClassVar[int] = 12

    @classmethod
    def of(cls, T: NDArray[np.float64], number: Lift = float) -> "Matrix":
        """A pose (4, 4), its entries made into numbers."""
        a, b, c = (tuple(number(x) for x in row) for row in T[:3, :3].tolist())
        return cls((a, b, c), tuple(number(x) for x in T[:3, 3].tolist()))

    @classmethod
    def turn(cls, axis: int, angle: Number) -> "Matrix":
        """Rotation about x, y or z (0, 1, 2) [rad]."""
        c, s = cos(angle), sin(angle)
        j, k = (axis + 1) % 3, (axis + 2) % 3
        rows = [[0, 0, 0] for _ in range(3)]
        rows[axis][axis] = 1
        rows[j][j], rows[j][k] = c, -s
        rows[k][j], rows[k][k] = s, c
        return cls((tuple(rows[0]), tuple(rows[1]), tuple(rows[2])), (0, 0, 0))

    @classmethod
    def shift(cls, p: Sequence[Number]) -> "Matrix":
        """Translation [m]."""
        return cls((UNIT[0], UNIT[1], UNIT[2]), tuple(p))

    def compose(self, other: "Matrix") -> "Matrix":
        """Self after other."""
        a, b = self.R, other.R
        columns = tuple(zip(*b, strict=True))
        R = tuple(tuple(_dot(row, column) for column in columns) for row in a)
        return Matrix((R[0], R[1], R[2]), self.act(other.p))

    def inverse(self) -> "Matrix":
        """The transform that undoes this one."""
        a, b, c = zip(*self.R, strict=True)
        back = Matrix((a, b, c), (0, 0, 0))
        return Matrix(back.R, tuple(-x for x in back.act(self.p)))

    def rotation(self) -> "Matrix":
        """The same without its translation."""
        return Matrix(self.R, (0, 0, 0))

    def act(self, x: Sequence[Number]) -> Numbers:
        """A point moved."""
        return tuple(_dot(row, x) + t for row, t in zip(self.R, self.p, strict=True))

    def map(self, lift: Lift) -> "Matrix":
        """The same with every stored number passed through lift."""
        R = tuple(tuple(map(lift, row)) for row in self.R)
        return Matrix((R[0], R[1], R[2]), tuple(map(lift, self.p)))


@dataclass(frozen=True)
class Pair:
    """Unit quaternion w, x, y, z and translation: 7 numbers."""

    h: Numbers
    p: Numbers
    name: ClassVar[str] = "pair"
    scalars: ClassVar[int] = 7

    @classmethod
    def of(cls, T: NDArray[np.float64], number: Lift = float) -> "Pair":
        """A pose (4, 4), its entries made into numbers."""
        h = se3.quat_from_rotation(T[:3, :3]).tolist()
        return cls(tuple(map(number, h)), tuple(map(number, T[:3, 3].tolist())))

    @classmethod
    def turn(cls, axis: int, angle: Number) -> "Pair":
        """Rotation about x, y or z (0, 1, 2) [rad]."""
        return cls(_half_turn(axis, angle), (0, 0, 0))

    @classmethod
    def shift(cls, p: Sequence[Number]) -> "Pair":
        """Translation [m]."""
        return cls((1, 0, 0, 0), tuple(p))

    def compose(self, other: "Pair") -> "Pair":
        """Self after other: thesis of Jha (2015), equation 4.99."""
        return Pair(_hamilton(self.h, other.h), self.act(other.p))

    def inverse(self) -> "Pair":
        """The transform that undoes this one: equation 4.97."""
        back = Pair(_conjugate(self.h), (0, 0, 0))
        return Pair(back.h, tuple(-x for x in back.act(self.p)))

    def rotation(self) -> "Pair":
        """The same without its translation."""
        return Pair(self.h, (0, 0, 0))

    def act(self, x: Sequence[Number]) -> Numbers:
        """A point moved: ``x + 2 r (v x x) + 2 v x (v x x) + p``, the doubling done once."""
        r, v = self.h[0], self.h[1:]
        twice = tuple(c + c for c in _cross(v, x))
        again = _cross(v, twice)
        return tuple(a + r * b + c + t for a, b, c, t in zip(x, twice, again, self.p, strict=True))

    def map(self, lift: Lift) -> "Pair":
        """The same with every stored number passed through lift."""
        return Pair(tuple(map(lift, self.h)), tuple(map(lift, self.p)))


@dataclass(frozen=True)
class Dual:
    """Unit dual quaternion: real part, and half the translation times it: 8 numbers."""

    real: Numbers
    dual: Numbers
    name: ClassVar[str] = "dual quaternion"
    scalars: ClassVar[int] = 8

    @classmethod
    def of(cls, T: NDArray[np.float64], number: Lift = float) -> "Dual":
        """A pose (4, 4), its entries made into numbers."""
        pair = Pair.of(T, number)
        return cls.shift(pair.p).compose(cls(pair.h, (0, 0, 0, 0)))

    @classmethod
    def turn(cls, axis: int, angle: Number) -> "Dual":
        """Rotation about x, y or z (0, 1, 2) [rad]."""
        return cls(_half_turn(axis, angle), (0, 0, 0, 0))

    @classmethod
    def shift(cls, p: Sequence[Number]) -> "Dual":
        """Translation [m]."""
        return cls((1, 0, 0, 0), (0, *(0.5 * x for x in p)) if any(map(_there, p)) else (0,) * 4)

    def compose(self, other: "Dual") -> "Dual":
        """Self after other."""
        left, right = _hamilton(self.real, other.dual), _hamilton(self.dual, other.real)
        dual = tuple(a + b for a, b in zip(left, right, strict=True))
        return Dual(_hamilton(self.real, other.real), dual)

    def inverse(self) -> "Dual":
        """The transform that undoes this one."""
        return Dual(_conjugate(self.real), _conjugate(self.dual))

    @property
    def p(self) -> Numbers:
        """The translation [m]."""
        half = _hamilton(self.dual, _conjugate(self.real))[1:]
        return tuple(x + x for x in half)

    def act(self, x: Sequence[Number]) -> Numbers:
        """A point moved."""
        return Pair(self.real, self.p).act(x)

    def map(self, lift: Lift) -> "Dual":
        """The same with every stored number passed through lift."""
        return Dual(tuple(map(lift, self.real)), tuple(map(lift, self.dual)))


AnyForm = TypeVar("AnyForm", Matrix, Pair, Dual)

FORMS: tuple[type[Matrix] | type[Pair] | type[Dual], ...] = (Matrix, Pair, Dual)


def _there(x: Number) -> bool:
    return not (type(x) is int and x == 0)


def _dot(a: Sequence[Number], b: Sequence[Number]) -> Number:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: Sequence[Number], b: Sequence[Number]) -> Numbers:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _conjugate(h: Numbers) -> Numbers:
    return (h[0], -h[1], -h[2], -h[3])


def _hamilton(a: Numbers, b: Numbers) -> Numbers:
    """``ij = k``: equation 4.98 with v1 x v2 for the printed v2 x v1."""
    return (
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    )


def _half_turn(axis: int, angle: Number) -> Numbers:
    half = 0.5 * angle
    vector: list[Number] = [0, 0, 0]
    vector[axis] = sin(half)
    return (cos(half), *vector)
