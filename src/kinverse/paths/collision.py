"""Collision by capsules: the links of an arm against each other, spheres and a floor."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse import se3
from kinverse.errors import InputError

if TYPE_CHECKING:
    from kinverse.robot import Robot

__all__ = ["Capsules", "segment_distance"]

Array = NDArray[np.float64]

SHORT = 1e-9
"""Links shorter than this [m] are none: the joints of a spherical wrist have one origin."""
CHUNK = 20_000
"""Joint values at once."""


class Capsules:
    """A predicate for ``track`` and ``Solutions.filter``: which joint values keep the arm clear.

    Link 0 runs from the base's origin to that of joint 1, link i from the origin of joint i to that
    of joint i + 1, the last one to the tool point; each is a capsule (a segment with a radius).
    Links meet that have at least one link between them, unless what is between is so short that
    they must touch: shorter than the sum of their radii along the chain.

    Args:
        robot: the arm.
        radii: [m], one number or (L,) for L = moving joints + 1 links.
        spheres: (K, 4) obstacles x, y, z, radius [m] in the base frame.
        floor: height z [m] in the base frame that links stay above; None: no floor.
        floor_from: first link that the floor is for; those before it may stand in it. None: 1, or
            2 where link 1 stands in it wherever the joints are (its other end is that of link 2).
        self_collision: whether the links are tested against each other.
        margin: distance [m] to keep beyond touching.

    Raises:
        InputError: wrong shapes, values that are not finite, negative radii or margin.
        TypeError: complex, object or text data.

    Example:
        >>> clear = Capsules(robot, radii=0.06, spheres=[[0.8, 0.2, 0.5, 0.15]], floor=-0.1)
        >>> track(robot, T, keep=clear)
    """

    ignores_turns = True
    """Whole turns of a joint change nothing: ``track`` asks about one winding of a solution."""

    def __init__(
        self,
        robot: "Robot",
        radii: ArrayLike,
        spheres: ArrayLike | None = None,
        floor: float | None = None,
        floor_from: int | None = None,
        self_collision: bool = True,
        margin: float = 0.0,
    ) -> None:
        links = len(robot.kinds) + 1
        given = _finite("radii", radii)
        if given.shape not in ((), (links,)):
            raise InputError(
                f"radii must be a number or ({links},), one for each link of {robot.name}, got"
                f" {given.shape}"
            )
        self.robot = robot
        self.radii = np.broadcast_to(given, (links,)).copy()
        obstacles = np.empty((0, 4)) if spheres is None else _finite("spheres", spheres)
        if obstacles.ndim != 2 or obstacles.shape[1] != 4:
            raise InputError(f"spheres must be (K, 4): x, y, z, radius, got {obstacles.shape}")
        self.spheres = obstacles
        self.floor = None if floor is None else float(_finite("floor", floor))
        self.margin = float(_finite("margin", margin))
        if floor_from is None:
            foot = robot.frames[0][2, 3] - self.radii[min(1, links - 1)]
            stands = self.floor is not None and foot < self.floor + self.margin
            floor_from = 2 if stands and links > 2 else 1
        if not 0 <= floor_from <= links:
            raise InputError(f"floor_from must lie in 0..{links}, got {floor_from}")
        self.floor_from = int(floor_from)
        for name, values in (
            ("radii", self.radii),
            ("spheres", obstacles[:, 3]),
            ("margin", margin),
        ):
            if np.any(np.asarray(values) < 0.0):
                raise InputError(f"{name}: radii and margin must not be negative")
        lengths = np.linalg.norm(robot.frames[:, :3, 3], axis=1)
        slides = np.array([kind == "P" for kind in robot.kinds] + [False])
        # a slide's own motion lies in the link behind it
        self.links = np.flatnonzero((lengths > SHORT) | np.append(False, slides[:-1]))
        self.pairs = self._pairs(lengths, slides) if self_collision else []

    def _pairs(self, lengths: Array, slides: NDArray[np.bool_]) -> list[tuple[int, int]]:
        pairs = []
        links: list[int] = self.links.tolist()
        for a, i in enumerate(links):
            for j in links[a + 2 :]:
                between = lengths[i + 1 : j].sum()
                if slides[i:j].any() or between > self.radii[i] + self.radii[j] + self.margin:
                    pairs.append((i, j))
        return pairs

    def __call__(self, q: ArrayLike) -> NDArray[np.bool_]:
        """(M,) whether joint values q (M, n) keep at least the margin everywhere."""
        return np.asarray(self.clearance(q) >= self.margin)

    def clearance(self, q: ArrayLike) -> Array:
        """Smallest distance (M,) [m] of joint values q (M, n), below zero in collision.

        Infinite where nothing is tested. Between capsules and spheres distances are exact; of
        bodies that overlap it tells by how much their radii are too large.

        Raises:
            InputError: another shape, NaN or inf.

        Example:
            >>> Capsules(robot, 0.05, floor=0.0).clearance(robot.random(10)) > 0.02
        """
        values = np.atleast_2d(se3.as_joints(q, self.robot.dof))
        parts = [self._clearance(values[k : k + CHUNK]) for k in range(0, len(values), CHUNK)]
        return np.concatenate(parts) if parts else np.empty(0)

    def points(self, q: ArrayLike) -> Array:
        """Ends of the links (M, L + 1, 3) [m]: the base's origin, all joints' origins, the tool."""
        robot = self.robot
        values = np.atleast_2d(se3.as_joints(q, robot.dof))
        moving = robot.multiplier * values[:, robot.source] + robot.offset
        T = np.broadcast_to(np.eye(4), (len(values), 4, 4))
        points = [T[:, :3, 3]]
        for i, kind in enumerate(robot.kinds):
            T = T @ robot.frames[i]
            points.append(T[:, :3, 3])
            J = np.tile(np.eye(4), (len(values), 1, 1))
            if kind == "R":
                c, s = np.cos(moving[:, i]), np.sin(moving[:, i])
                J[:, 0, 0], J[:, 0, 1], J[:, 1, 0], J[:, 1, 1] = c, -s, s, c
            else:
                J[:, 2, 3] = moving[:, i]
            T = T @ J
        points.append((T @ robot.frames[-1])[:, :3, 3])
        return np.stack(points, axis=1)

    def _clearance(self, q: Array) -> Array:
        points = self.points(q)
        least = np.full(len(q), np.inf)
        for i in self.links.tolist():
            a, b, radius = points[:, i], points[:, i + 1], self.radii[i]
            if self.floor is not None and i >= self.floor_from:
                low = np.minimum(a[:, 2], b[:, 2]) - radius - self.floor
                least = np.minimum(least, low)
            for *centre, r in self.spheres:
                c = np.broadcast_to(np.array(centre), a.shape)
                least = np.minimum(least, segment_distance(a, b, c, c) - radius - r)
        for i, j in self.pairs:
            far = segment_distance(points[:, i], points[:, i + 1], points[:, j], points[:, j + 1])
            least = np.minimum(least, far - self.radii[i] - self.radii[j])
        return least


def segment_distance(a: Array, b: Array, c: Array, d: Array) -> Array:
    """Distance (M,) between the segments a-b and c-d, points (M, 3); a segment may be a point.

    The lines' nearest points, clamped to one segment, then to the other (Ericson, Real-Time
    Collision Detection, 2005, section 5.1.9).

    Example:
        >>> o, x, z = np.zeros((1, 3)), np.eye(3)[:1], np.eye(3)[2:]
        >>> segment_distance(o, x, z, z + x)
        array([1.])
    """
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = _dot(u, u), _dot(v, v), _dot(u, v)
    uw, vw = _dot(u, w), _dot(v, w)
    across = uu * vv - uv * uv
    # of parallel segments any point of the first does, its other end is clamped to below
    is_skew = across > 1e-14 * uu * vv
    s = np.where(is_skew, np.clip(_over(uv * vw - vv * uw, across), 0.0, 1.0), 0.0)
    t = np.clip(_over(uv * s + vw, vv), 0.0, 1.0)
    s = np.clip(_over(uv * t - uw, uu), 0.0, 1.0)
    t = np.clip(_over(uv * s + vw, vv), 0.0, 1.0)
    return np.asarray(np.linalg.norm(w + s[:, None] * u - t[:, None] * v, axis=1))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray(np.einsum("ij,ij->i", a, b))


def _over(a: Array, b: Array) -> Array:
    return np.divide(a, b, out=np.zeros_like(a), where=b > 0.0)


def _finite(name: str, values: ArrayLike) -> Array:
    given = se3.as_real(values, name)
    if not np.isfinite(given).all():
        raise InputError(f"{name} must be finite")
    return given
