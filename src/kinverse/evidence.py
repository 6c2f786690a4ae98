"""Whether an answer is complete: what each pose's solutions, or their absence, rest on."""

import numpy as np
from numpy.typing import NDArray

from kinverse.status import METHODS
from kinverse.table import TableLike

__all__ = ["Evidence"]

BASES = ("measured", "measured", "shown", "searched")


class Evidence:
    """What each of N poses rests on: typed arrays of length N; ``str`` says it in words.

    Example:
        >>> s.stats.evidence.real_roots
        array([8, 4])
        >>> print(s[0].stats.evidence)
        elimination: 8 real and 8 complex roots; 0.12 rad between real ones, ...
    """

    __slots__ = ("_table",)

    def __init__(self, table: TableLike) -> None:
        self._table = table

    @property
    def records(self) -> NDArray[np.void]:
        """(N,) all of the following as one structured array, method as a number."""
        return self._table.evidence

    @property
    def basis(self) -> NDArray[np.str_]:
        """(N,) what each status rests on.

        "measured": forward kinematics of candidates; "shown": no joint values can do it;
        "searched": nothing found and nothing shown.
        """
        return np.array(BASES)[self._table.status]

    @property
    def method(self) -> NDArray[np.str_]:
        """(N,) how the pose was solved, one of ``kinverse.status.METHODS``.

        "closed form" and "elimination" give every solution; "sweep" is a search over the free
        parameter of a redundant arm; "search" ends when it has found something or given up;
        "bounds" (intervals, or the lengths of the links) show that there is no solution.
        """
        words: NDArray[np.str_] = np.array(METHODS)[self._table.evidence["method"]]
        return words

    @property
    def real_roots(self) -> NDArray[np.int32]:
        """(N,) real roots of the elimination, limits ignored; -1 where nothing was eliminated.

        For an arm of fewer than six joints they are those of the arm with virtual joints added.
        """
        return np.asarray(self._table.evidence["real_roots"])

    @property
    def complex_roots(self) -> NDArray[np.int32]:
        """(N,) roots that are not real; -1 where nothing was eliminated."""
        return np.asarray(self._table.evidence["complex_roots"])

    @property
    def root_gap(self) -> NDArray[np.float64]:
        """(N,) smallest angle between neighbouring real roots [rad]; 2 pi with fewer than two.

        NaN where nothing was eliminated. Where it is small, two solutions nearly meet.
        """
        return np.asarray(self._table.evidence["root_gap"])

    @property
    def root_margin(self) -> NDArray[np.float64]:
        """(N,) how far the complex root nearest to being real is from it.

        Roots are written z = exp(i angle) of one joint, and the margin is the size of log abs(z),
        the imaginary part of the angle [rad]. Infinite without complex roots, NaN where nothing
        was eliminated. UNREACHABLE takes more than 0.02.
        """
        return np.asarray(self._table.evidence["root_margin"])

    @property
    def weak(self) -> NDArray[np.bool_]:
        """(N,) whether solutions may be missing.

        Always so for searches and where nothing was found or shown; for an elimination where
        roots are too close, too near to being real, or too noisy to be counted with certainty: a
        numerical search has then added what it found.
        """
        return np.asarray(self._table.evidence["weak"])

    def __len__(self) -> int:
        return len(self._table.status)

    def __getitem__(self, pose: int) -> str:
        """What one pose rests on, in words."""
        row = self._table.evidence[pose]
        words = METHODS[row["method"]]
        if row["real_roots"] >= 0:
            words += f": {row['real_roots']} real and {row['complex_roots']} complex roots"
            if row["real_roots"] > 1:
                words += f", real ones {row['root_gap']:.2g} rad apart"
            if row["complex_roots"]:
                words += f", complex ones {row['root_margin']:.2g} off"
        return words + ", weak" * bool(row["weak"])

    def __str__(self) -> str:
        return "\n".join(self[pose] for pose in range(len(self)))

    def __repr__(self) -> str:
        if len(self) == 1:
            return f"Evidence: {self[0]}"
        count = np.bincount(self._table.evidence["method"], minlength=len(METHODS))
        shown = ", ".join(f"{name} {k}" for name, k in zip(METHODS, count, strict=True) if k)
        return f"Evidence: {len(self)} poses, {shown}, {int(self.weak.sum())} weak"
