"""What kinematics takes through matrices, pairs and dual quaternions: counted by running it."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from kinverse.robot import Robot
from kinverse.studies.counted import Counted, Tally
from kinverse.studies.forms import AnyForm, Dual, Matrix, Pair
from kinverse.studies.pair_kinematics import Route, inverse
from kinverse.studies.zero_arm import forward, zero_arm

__all__ = ["Count", "count_forms", "count_forward", "count_inverse"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Count:
    """What one computation took.

    Attributes:
        what: the computation.
        form: matrix, pair or dual quaternion.
        scalars: numbers stored for each transform.
        solutions: branches found by an inverse.
        operations: additions, multiplications, ...; see :class:`kinverse.studies.counted.Tally`.
    """

    what: str
    form: str
    scalars: int
    solutions: int
    operations: Tally

    def row(self) -> dict[str, str | int]:
        """The count as one flat record."""
        head = {"what": self.what, "form": self.form, "scalars": self.scalars}
        return {**head, "solutions": self.solutions, **asdict(self.operations)}


def count_forms() -> list[Count]:
    """Composition, inverse and action on a point, with no entry known beforehand.

    Example:
        >>> count_forms()[0].operations.multiplications
        36
    """
    return [*_form(Matrix), *_form(Pair), *_form(Dual)]


def _form(form: type[AnyForm]) -> Iterator[Count]:
    for what in ("compose", "inverse", "act"):
        tally = Tally()
        lift = partial(Counted, tally=tally)
        T = form.turn(0, 0.3).compose(form.shift((0.1, 0.2, 0.3))).map(lift)
        if what == "compose":
            T.compose(T)
        elif what == "inverse":
            T.inverse()
        else:
            T.act((lift(0.1), lift(0.2), lift(0.3)))
        yield Count(what, form.name, form.scalars, 0, tally)


def count_forward(robot: Robot, q: Array) -> list[Count]:
    """Forward kinematics of q (n,), zeros and ones of the arm's structure not counted.

    Example:
        >>> [count.form for count in count_forward(kv.load("puma560"), q)]
        ['matrix', 'pair', 'dual quaternion']
    """
    return [_forward(Matrix, robot, q), _forward(Pair, robot, q), _forward(Dual, robot, q)]


def _forward(form: type[AnyForm], robot: Robot, q: Array) -> Count:
    tally = Tally()
    lift = partial(Counted, tally=tally)
    T = forward(zero_arm(robot, lift), form, tuple(map(lift, q)))
    # the position is asked for: a dual quaternion has to work it out
    assert len(T.p) == 3
    return Count("forward", form.name, form.scalars, 0, tally)


def count_inverse(robot: Robot, T: Array) -> list[Count]:
    """Inverse kinematics of one pose (4, 4), all branches, by matrices and by pairs.

    Example:
        >>> [count.solutions for count in count_inverse(kv.load("puma560"), T)]
        [8, 8]
    """
    return [_inverse(Matrix, robot, T), _inverse(Pair, robot, T)]


def _inverse(form: type[Route], robot: Robot, T: Array) -> Count:
    tally = Tally()
    lift = partial(Counted, tally=tally)
    found = inverse(zero_arm(robot, lift), form.of(T, lift))
    return Count("inverse", form.name, form.scalars, len(found), tally)
