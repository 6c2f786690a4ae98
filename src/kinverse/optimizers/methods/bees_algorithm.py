"""Bees Algorithm: Pham et al., Technical Note, Cardiff (2005); Masajedi et al. (2013)."""

from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer, whole_number
from kinverse.optimizers.run import Run

__all__ = ["BeesAlgorithm"]

Array = NDArray[np.float64]


class BeesAlgorithm(Optimizer):
    """Scouts find sites, recruits search a patch round the best of them.

    Each step: recruits fall uniformly into a cube round each of the m selected sites and the best
    bee of a patch, its site included, is the site from then on; scouts fall anywhere in the box;
    of sites and scouts the m best are the sites of the next step. A site whose recruits have not
    improved it for ``abandon_after`` steps is left for

        x_new = x_old + w r (x_elite - x_old),     r in [0, 1), one number a site,

    where x_elite is drawn from the e elite sites: an elite that draws itself stays, so with one
    elite the best site is never lost.

    The defaults are those of Masajedi, Shirazi and Ghanbarzadeh (document 002), section 6: 50
    scouts, 3 selected sites, 1 elite, 4 recruits, radius 0.02, 3 steps. What it leaves open, and
    our readings: one number of recruits is given, taken for elites and others alike; its equation
    28, n = e ne + (m - e) ns + s, counts 50 scouts beside the 12 recruits, hence 62 points a step
    (behind a first step of scouts alone); the radius has no unit, taken as a fraction of each
    variable's range; w is never given, taken as 1; sites are chosen by rank, so the selection
    probability of its equation 29 has no part. The new place of an abandoned site has to be
    evaluated: its first recruit of the next step sits on it.

    ``BeesAlgorithm.pham()`` has the settings of Pham and Castellani (2009): as many scouts as keep
    the number of sites, patches that shrink when they fail, and sites abandoned for a random place.

    A patch that does not shrink sets a floor: with D variables of range 1 the best of many recruits
    seldom comes closer than some tenths of the radius.

    Args:
        population: scouts of the first step.
        scouts: scouts of every later step; None: as many as in the first.
        sites: m, the best sites, which are searched further.
        elites: e, the best of these.
        elite_recruits: recruits of each elite site.
        recruits: recruits of each other site.
        radius: half the edge of a patch.
        radius_unit: "range" (radius is a fraction of each variable's range) or "own" (it is in
            the variables' own units: radians).
        shrink: a patch without improvement is made smaller by this factor; 1 keeps it.
        abandon_after: steps without improvement after which a site is left; None: never.
        relocation: where to: "elite" (equation above) or "random" (anywhere in the box).
        pull: w, how far towards the elite.

    Example:
        >>> minimize(f, bounds, BeesAlgorithm(), max_evals=20_000).x
    """

    least_population: ClassVar[int] = 3

    def __init__(
        self,
        *,
        population: int = 50,
        scouts: int | None = None,
        sites: int = 3,
        elites: int = 1,
        elite_recruits: int = 4,
        recruits: int = 4,
        radius: float = 0.02,
        radius_unit: str = "range",
        shrink: float = 1.0,
        abandon_after: int | None = 3,
        relocation: str = "elite",
        pull: float = 1.0,
    ) -> None:
        self.population = population
        self.scouts = scouts
        self.sites = sites
        self.elites = elites
        self.elite_recruits = elite_recruits
        self.recruits = recruits
        self.radius = radius
        self.radius_unit = radius_unit
        self.shrink = shrink
        self.abandon_after = abandon_after
        self.relocation = relocation
        self.pull = pull

    @classmethod
    def pham(cls, **settings: Any) -> Self:
        """The method as Pham and Castellani describe it, Proc. IMechE C 223 (2009) 2919.

        Patches begin as large as the box, shrink to 0.8 when they fail, and are left for a random
        place after 10 failures in a row; of ``population`` bees those that hold no site scout. The
        numbers of bees are tuned to each problem there; those here are ours, for six joints.
        """
        bees = {"population": 20, "sites": 10, "elites": 3, "elite_recruits": 20, "recruits": 8}
        patches = {"radius": 0.5, "shrink": 0.8, "abandon_after": 10, "relocation": "random"}
        chosen: dict[str, Any] = bees | patches | settings
        whole_number("BeesAlgorithm: population", chosen["population"], cls.least_population)
        whole_number("BeesAlgorithm: sites", chosen["sites"], 1)
        return cls(**{"scouts": max(chosen["population"] - chosen["sites"], 0)} | chosen)

    def _check(self, dimensions: int) -> None:
        for name, least in (("sites", 1), ("elites", 1), ("elite_recruits", 1), ("recruits", 1)):
            whole_number(f"BeesAlgorithm: {name}", getattr(self, name), least)
        if self.scouts is not None:
            whole_number("BeesAlgorithm: scouts", self.scouts, 0)
        if self.abandon_after is not None:
            whole_number("BeesAlgorithm: abandon_after", self.abandon_after, 1)
        if self.sites > self.population:
            raise InputError(
                f"sites must be at most the population, {self.population}, got {self.sites}"
            )
        if self.elites > self.sites:
            raise InputError(f"elites must be at most sites, {self.sites}, got {self.elites}")
        if not 0.0 < self.radius < np.inf:
            raise InputError(f"radius must be positive and finite, got {self.radius!r}")
        if not 0.0 < self.shrink <= 1.0:
            raise InputError(f"shrink must lie in 0..1 and not be 0, got {self.shrink!r}")
        if not 0.0 <= self.pull < np.inf:
            raise InputError(f"pull must be finite and not negative, got {self.pull!r}")
        for name, valid in (("radius_unit", ("range", "own")), ("relocation", ("elite", "random"))):
            if getattr(self, name) not in valid:
                raise InputError(
                    f"{name} must be one of {', '.join(valid)}, got {getattr(self, name)!r}"
                )

    def _begin(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        shape = len(x), self.sites
        # sites that are worse than any scout: the first selection takes scouts for all of them
        s.x, s.f = x[:, : self.sites], np.full(shape, np.inf)
        s.idle, s.radius = np.zeros(shape, np.int64), np.full(shape, float(self.radius))
        s.moved = np.zeros(shape, bool)
        self._select(run, x, f)

    def _ask(self, run: Run) -> Array:
        s = run.state
        counts = self._counts()
        owner = np.repeat(np.arange(self.sites), counts)
        first = np.cumsum(counts) - counts
        points = run.uniform(len(owner) + self._scouts(), len(run.low))
        patch, rest = points[:, : len(owner)], points[:, len(owner) :]
        patch *= 2.0
        patch -= 1.0
        patch *= s.radius[:, owner, None]
        if self.radius_unit == "range":
            patch *= run.span
        patch[:, first] *= ~s.moved[:, :, None]  # a new place is looked at itself
        patch += s.x[:, owner]
        run.clip(patch)
        rest *= run.span
        rest += run.low
        return points

    def _tell(self, run: Run, x: Array, f: Array) -> None:
        s = run.state
        counts = self._counts()
        best = np.empty((len(f), self.sites), np.int64)
        e, start, stop = self.elites, int(counts[: self.elites].sum()), int(counts.sum())
        best[:, :e] = _lowest(f[:, :start], e)
        best[:, e:] = _lowest(f[:, start:stop], self.sites - e) + start
        rows = np.arange(len(f))[:, None]
        value = f[rows, best]
        gained = value < s.f
        s.x = np.where(gained[:, :, None], x[rows, best], s.x)
        s.f = np.where(gained, value, s.f)
        s.idle = np.where(gained, 0, s.idle + 1)
        s.radius = np.where(gained, s.radius, s.radius * self.shrink)
        self._select(run, x[:, stop:], f[:, stop:])
        self._abandon(run)

    def _members(self, run: Run) -> tuple[Array, Array]:
        # the sites before any was left, and the best scouts of the last step
        s = run.state
        order = s.pool_f.argsort(axis=1, kind="stable")[:, : self.population]
        rows = np.arange(len(order))[:, None]
        return s.pool_x[rows, order], s.pool_f[rows, order]

    def _counts(self) -> NDArray[np.int64]:
        """Recruits of each site, by its rank."""
        return np.where(np.arange(self.sites) < self.elites, self.elite_recruits, self.recruits)

    def _scouts(self) -> int:
        return self.population if self.scouts is None else self.scouts

    def _select(self, run: Run, x: Array, f: Array) -> None:
        """The best of the sites and the scouts x, f, in order."""
        s = run.state
        s.pool_x, s.pool_f = np.concatenate([s.x, x], axis=1), np.concatenate([s.f, f], axis=1)
        order = s.pool_f.argsort(axis=1, kind="stable")[:, : self.sites]
        rows = np.arange(len(order))[:, None]
        held = order < self.sites
        was = np.where(held, order, 0)
        s.x, s.f = s.pool_x[rows, order], s.pool_f[rows, order]
        s.idle = np.where(held, s.idle[rows, was], 0)
        s.radius = np.where(held, s.radius[rows, was], self.radius)

    def _abandon(self, run: Run) -> None:
        if self.abandon_after is None:
            return
        s = run.state
        left = s.idle >= self.abandon_after
        if self.relocation == "random":
            place, s.moved = run.scatter(self.sites), left
        else:
            r = run.uniform(2, self.sites)
            elite = (self.elites * r[:, 1]).astype(np.int64)
            rows = np.arange(len(elite))[:, None]
            place = s.x + self.pull * r[:, 0, :, None] * (s.x[rows, elite] - s.x)
            s.moved = left & (elite != np.arange(self.sites))
        s.x = np.where(s.moved[:, :, None], run.clip(place), s.x)
        s.f = np.where(s.moved, np.inf, s.f)
        s.idle[left] = 0
        s.radius[s.moved] = self.radius


def _lowest(f: Array, patches: int) -> NDArray[np.int64]:
    """Where the lowest value of each patch is: (A, patches * n) to (A, patches)."""
    if patches == 0:
        return np.empty((len(f), 0), np.int64)
    each = f.reshape(len(f), patches, -1)
    return np.asarray(each.argmin(axis=2) + each.shape[2] * np.arange(patches))
