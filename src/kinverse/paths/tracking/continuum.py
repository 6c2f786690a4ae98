"""Samples in a singularity: of a continuum of solutions, the members that a path would take."""

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from kinverse.paths.tracking.layers import Layers, short_way
from kinverse.paths.tracking.samples import Samples

if TYPE_CHECKING:
    from kinverse.paths.tracking.branches import Branches

__all__ = ["with_members"]

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

MOST = 32
"""Members that are followed at once."""
SAME = 1e-6
"""A member nearer than this to another row of its sample [rad or m] is no new one."""


def with_members(branches: "Branches", samples: Samples, layers: Layers, max_step: Array) -> Layers:
    """The layers with members of continua added: those within a step of the rows beside them.

    A layer holds one member a branch, that nearest the middle of the limits. Through each run of
    singular samples the rows before it are followed forwards and those behind it backwards, each to
    the member nearest to it. A member is on no side of its singularity.
    """
    if not layers.continuum.any():
        return layers
    edges = np.diff(np.concatenate([[False], layers.continuum, [False]]).astype(int))
    runs = zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True)
    sample: list[Ints] = []
    found: list[Array] = []
    branch: list[NDArray[np.int32]] = []
    fixed: list[NDArray[np.bool_]] = []
    for first, last in runs:
        for way in (range(first, last), range(last - 1, first - 1, -1)):
            before = way[0] - way.step
            # a path that begins or ends in the run: from the members that are known
            outside = 0 <= before < len(layers)
            near = _rows(layers, before if outside else way[0])
            for k in way:
                T = np.repeat(samples.T[k : k + 1], len(near), axis=0)
                if not len(T):
                    break
                members = branches.near(T, near)
                step = short_way(branches.robot, near[members.sample], members.q)
                is_near = (np.abs(step) <= max_step).all(axis=1)
                near, which = np.unique(
                    np.round(members.q[is_near] / SAME) * SAME, axis=0, return_index=True
                )
                rows = np.flatnonzero(is_near)[which[:MOST]]
                near = members.q[rows]
                old = short_way(branches.robot, _rows(layers, k)[None], near[:, None])
                new = rows[np.all(np.any(np.abs(old) > SAME, axis=2), axis=1)]
                sample.append(np.full(len(new), k))
                found.append(members.q[new])
                branch.append(members.branch[new])
                fixed.append(members.fixed[new])
    if not sample:
        return layers
    at, q = np.concatenate(sample), np.concatenate(found)
    return layers.with_rows(at, q, np.concatenate(branch), -1, np.concatenate(fixed))


def _rows(layers: Layers, sample: int) -> Array:
    return layers.q[layers.start[sample] : layers.start[sample + 1]][:MOST]
