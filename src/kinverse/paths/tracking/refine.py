"""Samples added to a path until the tool stays near it between them."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.paths.tracking.layers import Layers, joined, kept
from kinverse.paths.tracking.problem import Problem
from kinverse.paths.tracking.search import Found

__all__ = ["deviations", "refined"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

ROUNDS = 24
"""Rounds of adding samples."""
MOST_SAMPLES = 1_000_000
"""Samples that a path may come to have."""
MOST_PIECES = 16
"""Pieces an interval is cut into at once."""
BREAK_ROUNDS = 6
"""Rounds in which intervals with a break are halved."""
PLACES = 7
"""Places between two samples that are looked at, evenly; a deviation that is no parabola over the
interval (behind a spike, or where it changes its sign) does not stand half-way."""
LAST_PLACES = 31
"""The same where these tell the largest deviations: the largest of so many misses that of a smooth
deviation by less than 1 in 1000, that of a corner by 3 in 100."""
NEAR_LARGEST = 0.8
"""Only intervals whose deviation is this part of the largest one are looked at so closely."""
MOST_PLACES = 200_000
"""Places that are looked at together."""

Follow = Callable[[Problem, Layers], tuple[Layers, Found]]


def deviations(problem: Problem, found: Found) -> Array:
    """(N - 1,) largest distance [m] of the tool from the path before the next sample; NaN at gaps.

    Where it is largest it is looked at more closely.
    """
    away = np.full(len(found.q) - 1, np.nan)
    linked = np.flatnonzero(found.linked[1:])
    away[linked] = _between(problem, found, linked, PLACES)
    if len(linked):
        large = np.flatnonzero(away >= NEAR_LARGEST * np.nanmax(away))
        away[large] = np.maximum(away[large], _between(problem, found, large, LAST_PLACES))
    return away


def _between(problem: Problem, found: Found, samples: Ints, places: int) -> Array:
    """Largest distance (K,) [m] in so many places, spread evenly, behind each of samples (K,)."""
    fraction = np.arange(1.0, places + 1.0) / (places + 1.0)
    away = np.empty(len(samples))
    for k in range(0, len(samples), MOST_PLACES // places):
        at = samples[k : k + MOST_PLACES // places]
        a, b = found.q[at, None], found.q[at + 1, None]
        q = (a + fraction[:, None] * (b - a)).reshape(-1, a.shape[2])
        wanted = problem.samples.at(np.repeat(at, places), np.tile(fraction, len(at)))
        far = np.linalg.norm((problem.branches.fk(q) - wanted)[:, :3, 3], axis=1)
        away[k : k + len(at)] = far.reshape(-1, places).max(axis=1)
    return away


def refined(
    problem: Problem, layers: Layers, found: Found, tolerance: float, follow: Follow
) -> tuple[Problem, Layers, Found, float]:
    """The same with samples added, and the largest deviation that is left [m].

    Chords err with the square of their length, so an interval is cut into as many pieces as that
    tells; intervals with a break are halved a few times.

    Raises:
        InputError: the tolerance would take more than 1,000,000 samples.
    """
    for k in range(ROUNDS):
        away = deviations(problem, found)
        pieces = np.ceil(np.sqrt(np.nan_to_num(away) / tolerance)).astype(np.int64)
        pieces = np.clip(pieces, 1, MOST_PIECES)
        live = found.row >= 0
        if k < BREAK_ROUNDS:
            pieces[np.isnan(away) & live[1:] & live[:-1]] = 2
        if (pieces == 1).all():
            break
        added = int((pieces - 1).sum())
        if len(live) + added > MOST_SAMPLES:
            raise InputError(
                f"tolerance={tolerance:g} m would take more than {MOST_SAMPLES} samples: the joint"
                f" motion is {np.nanmax(away):.3g} m off between {len(live)} of them"
            )
        sample = np.repeat(np.arange(len(pieces)), pieces - 1)
        behind = np.concatenate([[0], np.cumsum(pieces - 1)])[:-1]
        fraction = (np.arange(added) - behind[sample] + 1.0) / pieces[sample]
        near = found.q[sample] + fraction[:, None] * (found.q[sample + 1] - found.q[sample])
        near[~found.linked[sample + 1]] = np.nan
        samples, order = problem.samples.with_between(sample, fraction)
        new = problem.branches.near(problem.samples.at(sample, fraction), near)
        problem = replace(problem, samples=samples)
        new = kept(problem.robot, new, problem.keep)
        layers = joined([layers, new]).taken(order)
        layers, found = follow(problem, layers)
    else:
        away = deviations(problem, found)
    return problem, layers, found, float(np.nanmax(away, initial=0.0))
