"""Particle swarm: Kennedy & Eberhart, Proc. ICNN (1995) 1942; inertia: Shi & Eberhart (1998)."""

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, real_number, whole_number
from kinverse.optimizers.run import Run

__all__ = ["ParticleSwarm"]

Array = NDArray[np.float64]


class ParticleSwarm(Optimizer):
    """Particles drawn to their own best point and to the swarm's.

    v = w v + c1 r1 (p - x) + c2 r2 (g - x), x = x + v, with fresh r1, r2 in [0, 1) for every
    component; all particles move before the swarm's best is looked at again (synchronous). The
    inertia w falls linearly over the budget. What leaves the box is put on its edge and its
    velocity turned round and halved.

    With ``neighbours=k`` a particle knows only the best of itself and the k particles on either
    side of it in a ring (the local best of Eberhart & Kennedy, Proc. MHS (1995) 39): good news
    travels slowly and the swarm gathers later, which on objectives with many valleys, as a robot
    arm's pose error, finds the deep one more often.

    The constricted swarm of Clerc & Kennedy, IEEE T. Evol. Comput. 6 (2002) 58, is the same
    recursion with other numbers: ``inertia=(0.7298, 0.7298), cognitive=1.49618, social=1.49618``.

    Args:
        population: particles.
        inertia: (w at the start, w at the end); equal ones keep it.
        cognitive: c1, the pull to a particle's own best.
        social: c2, the pull to the swarm's, or the neighbours', best.
        max_velocity: largest step of a variable, as a fraction of its range.
        neighbours: None (everyone knows the swarm's best) or how many on either side in the ring.

    Example:
        >>> minimize(f, bounds, ParticleSwarm(neighbours=4), max_evals=20_000).x
    """

    def __init__(
        self,
        *,
        population: int = 100,
        inertia: tuple[float, float] = (0.9, 0.4),
        cognitive: float = 2.0,
        social: float = 2.0,
        max_velocity: float = 0.2,
        neighbours: int | None = None,
    ) -> None:
        self.population = population
        self.inertia = inertia
        self.cognitive = cognitive
        self.social = social
        self.max_velocity = max_velocity
        self.neighbours = neighbours

    def _check(self, dimensions: int) -> None:
        if not isinstance(self.inertia, (tuple, list)) or len(self.inertia) != 2:
            raise InputError(f"inertia must be (start, end), got {self.inertia!r}")
        for name, value in zip(("start", "end"), self.inertia, strict=True):
            real_number(f"inertia at the {name}", value, 0.0)
        real_number("cognitive", self.cognitive, 0.0)
        real_number("social", self.social, 0.0)
        real_number("max_velocity", self.max_velocity, 0.0, 1.0)
        if self.max_velocity == 0.0:
            raise InputError("max_velocity must be above 0, got 0")
        if self.neighbours is not None:
            most = (self.population - 1) // 2
            real_number("neighbours", self.neighbours, 1, most)
            whole_number("neighbours", self.neighbours, 1)

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        s.x, s.p, s.f = x.copy(), x, f
        s.v = (2.0 * run.uniform(*x.shape[1:]) - 1.0) * (self.max_velocity * run.span)

    def _ask(self, run: Run) -> Array:
        s = run.state
        first, last = self.inertia
        most = self.max_velocity * run.span
        r = run.uniform(2, *s.x.shape[1:])
        s.v *= first + (last - first) * run.elapsed
        for pull, towards, share in (
            (self.cognitive, s.p, r[:, 0]),
            (self.social, self._guides(run), r[:, 1]),
        ):
            step = towards - s.x
            step *= share
            step *= pull
            s.v += step
        np.maximum(s.v, -most, out=s.v)
        np.minimum(s.v, most, out=s.v)
        moved = s.x + s.v
        x = s.x = run.clip(moved.copy())
        s.v[x != moved] *= -0.5
        return x

    def _guides(self, run: Run) -> Array:
        """The best points known to the particles: (A, 1, D), or (A, K, D) in a ring."""
        k = self.neighbours
        if k is None:
            return run.leader
        p, f = run.state.p, run.state.f
        problems, count, dimensions = p.shape
        ring = np.concatenate([f[:, -k:], f, f[:, :k]], axis=1)
        window = np.lib.stride_tricks.sliding_window_view(ring, 2 * k + 1, axis=1)
        best = (window.argmin(axis=2) + np.arange(-k, count - k)) % count
        best += count * np.arange(problems)[:, None]
        guides: Array = p.reshape(-1, dimensions)[best]
        return guides

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        better = f < s.f
        np.copyto(s.p, x, where=better[:, :, None])
        np.copyto(s.f, f, where=better)

    def _members(self, run: Run) -> tuple[Array, Array]:
        return run.state.p, run.state.f
