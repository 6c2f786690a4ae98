"""What a planar arm reaches: points, the exact edge, and where it can point every way."""

from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError
from kinverse.robot import Robot
from kinverse.solvers import make_solver
from kinverse.workspace.boundary import BoundaryArc, boundary, enclosed_area
from kinverse.workspace.links import reaches
from kinverse.workspace.planar_arm import planar_arm

__all__ = ["PlanarWorkspace"]

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

MOST_LIMITED = 6
"""Joints that move the tool, if one of them has limits, at most: the arcs multiply by each."""

MOST_ORIENTATIONS = 100_000
"""Orientations of ``service``, at most."""


class PlanarWorkspace:
    """The workspace of an arm whose joints turn about parallel axes.

    The two types of document 004 (Jha 2015, section 1.3.4): *reachable*, all places of the tool
    inside the limits, and *dextrous*, those reached with the tool pointing every way. Points are
    (N, 2) in the plane of the arm, x and y of ``frame``: for an arm with axes along the base's z
    the x and y of the base.

    Args:
        robot: the arm.

    Raises:
        InputError: the robot slides, is not planar, has mimic joints or only one joint.

    Example:
        >>> space = PlanarWorkspace(kv.load("planar3r_003"))
        >>> space.reaches([[20.0, 0.0], [-15.0, 0.0]])
        array([ True, False])
    """

    def __init__(self, robot: Robot) -> None:
        if not isinstance(robot, Robot):
            raise InputError(f"robot must be a kinverse.Robot, got {type(robot).__name__}")
        self._arm = planar_arm(robot)

    @property
    def robot(self) -> Robot:
        """The arm as given."""
        return self._arm.robot

    @property
    def frame(self) -> Array:
        """(4, 4) the plane in the base frame."""
        return self._arm.frame.copy()

    @property
    def center(self) -> Array:
        """(2,) the axis of the first joint [m]."""
        return np.array([self._arm.first.real, self._arm.first.imag])

    @property
    def annulus(self) -> tuple[float, float]:
        """Least and greatest distance from ``center`` that the links allow, limits left out [m].

        Without limits on the joints everything between them is reached.
        """
        return self._arm.reach.annulus

    @property
    def turns_fully(self) -> bool:
        """Whether every joint reaches every angle."""
        return bool(self._arm.reach.full.all() and self._arm.last_full)

    def points(self, count: int = 10_000, rng: "int | np.random.Generator | None" = None) -> Array:
        """Places (count, 2) of the tool for joint values drawn evenly inside the limits.

        Document 003, figure 4.

        Args:
            count: how many.
            rng: as in ``robot.random``.

        Example:
            >>> space.points(500, rng=1).shape
            (500, 2)
        """
        if isinstance(count, bool) or not isinstance(count, int | np.integer) or count < 0:
            raise InputError(f"count must be a whole number, not negative, got {count!r}")
        places = self.robot.fk(self.robot.random(int(count), rng))[:, :3, 3]
        return np.asarray((places - self._arm.frame[:3, 3]) @ self._arm.frame[:3, :2])

    def reaches(self, points: ArrayLike) -> Bools:
        """Whether the tool gets to points (N, 2), limits held: exact, nothing is sampled.

        On the edge itself (to about 1e-12 of the reach) rounding decides.

        Raises:
            InputError: another shape, or NaN.

        Example:
            >>> space.reaches(space.points(100)).all()
            True
        """
        return reaches(self._arm.reach, self._places(points))

    @cached_property
    def boundary(self) -> tuple[BoundaryArc, ...]:
        """The exact edge of the reachable set, as arcs; limits held.

        Without limits two circles (or one), with them arcs on which each joint is at a limit or in
        line with the tool.

        Raises:
            InputError: joints with limits and more than six that move the tool.
            NoSolution: the edge found does not close, as too many arcs nearly touch.

        Example:
            >>> [arc.radius for arc in PlanarWorkspace(free_arm).boundary]
            [22.0]
        """
        links = self._arm.reach
        if links.full.all():
            (low, high), (x, y) = links.annulus, self.center.tolist()
            circles = [(high, "inside"), (low, "outside")]
            shown = [(r, side) for r, side in circles if r > 1e-12 * high]
            return tuple(BoundaryArc((x, y), r, 0.0, 2.0 * np.pi, side) for r, side in shown)
        if len(links.d) > MOST_LIMITED:
            raise InputError(
                f"the edge of a limited arm is found for up to {MOST_LIMITED} joints that move the"
                f" tool, robot {self.robot.name!r} has {len(links.d)}: take points or reaches"
            )
        return boundary(links, self._arm.first)

    @property
    def area(self) -> float:
        """Area of the reachable set [m^2], from its edge.

        To rounding, or to about 1e-5 of the arm's reach squared where arcs nearly touch.

        Raises:
            InputError, NoSolution: as ``boundary``.
        """
        return enclosed_area(self.boundary)

    @property
    def dextrous_radii(self) -> Array:
        """(K, 2) ranges of the distance from ``center`` that make the dextrous set, exact [m].

        A point at distance r is reached with every direction of the last link if the rest of the
        arm reaches every distance from abs(r - l) to r + l.

        Raises:
            InputError: joints that do not reach every angle: the set is no ring then; see
                ``service``.

        Example:
            >>> PlanarWorkspace(free_arm).dextrous_radii      # 10, 7 and 5 m
            array([[ 0.,  2.],
                   [ 8., 12.]])
        """
        if not self.turns_fully:
            raise InputError(
                f"robot {self.robot.name!r} has joints with limits: its dextrous set is no ring;"
                " service(points) samples it"
            )
        (low, high), link = self._arm.rest.annulus, abs(self._arm.last_link)
        rings = [(0.0, min(link - low, high - link)), (low + link, high - link)]
        if low == 0.0:  # nothing is left out around the third joint: one disc
            rings = [(0.0, high - link)]
        return np.array([ring for ring in rings if ring[1] >= ring[0]]).reshape(-1, 2)

    def service(self, points: ArrayLike, orientations: int = 72) -> Array:
        """The share of orientations (N,) with which the tool reaches points (N, 2), limits held.

        Where it is 1 the point counts as dextrous. Orientations are even from 0 to a turn; for
        each, the other joints must bring the last axis to its place, which is exact. If the last
        joint has limits, the poses left are solved by "auto" with the task "planar": in closed form
        for three joints. For more, a search says what it found, so a share may be too small there.
        Two joints reach a point with two directions at most: a share of 0.

        Args:
            points: (N, 2) in the plane [m].
            orientations: how many.

        Raises:
            InputError: another shape, NaN, or no orientation.

        Example:
            >>> PlanarWorkspace(free_arm).service([[10.0, 0.0], [21.0, 0.0]])
            array([1.        , 0.18055556])
        """
        places = self._places(points)
        whole = not isinstance(orientations, bool) and isinstance(orientations, int | np.integer)
        if not whole or not 1 <= orientations <= MOST_ORIENTATIONS:
            raise InputError(
                f"orientations must be a whole number in 1..{MOST_ORIENTATIONS},"
                f" got {orientations!r}"
            )
        turn = 2.0 * np.pi * np.arange(int(orientations)) / int(orientations)
        last_axis = places[:, None] - self._arm.last_link * np.exp(1j * turn)
        can = reaches(self._arm.rest, last_axis.ravel())
        if not self._arm.last_full:
            point, direction = np.divmod(np.flatnonzero(can), len(turn))
            can[can] = self._solved(places[point], turn[direction])
        return np.asarray(can.reshape(len(places), len(turn)).mean(axis=1))

    def _solved(self, places: NDArray[np.complex128], turn: Array) -> Bools:
        """Which poses, at places (N,) from the first joint and turned by angles (N,), are solved.

        An arm whose joints read zero is not turned.
        """
        # seen from the plane, so that its normal is the z axis which the task turns about
        robot = self.robot.with_base(se3.inverse(self._arm.frame))
        level = robot.fk(np.zeros(robot.dof))
        T = se3.pose(rpy=np.stack([0.0 * turn, 0.0 * turn, turn], axis=1)) @ level
        at = places + self._arm.first
        T[:, 0, 3], T[:, 1, 3] = at.real, at.imag
        return make_solver("auto", robot, "planar").fit(robot).solve(T).ok

    def _places(self, points: ArrayLike) -> NDArray[np.complex128]:
        """Points (N, 2) as complex numbers from the first joint."""
        array = se3.as_real(points, "points")
        if array.ndim != 2 or array.shape[1] != 2:
            raise InputError(f"points must have shape (N, 2), got {array.shape}")
        bad = ~(np.abs(array) <= se3.MOST_METRES).all(axis=1)
        if bad.any():
            row = int(np.argmax(bad))
            raise InputError(f"points[{row}] (row {row}) is not finite: {array[row].tolist()}")
        return np.asarray(array[:, 0] + 1j * array[:, 1] - self._arm.first)

    def __repr__(self) -> str:
        low, high = self.annulus
        kind = "every joint turns fully" if self.turns_fully else "joints have limits"
        return f"PlanarWorkspace of {self.robot.name}: {low:g} to {high:g} m, {kind}"
