"""Which rows train and which test."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse.errors import InputError
from kinverse.seeds import seed_of

__all__ = ["split_rows"]

Ints = NDArray[np.int64]


def split_rows(
    count: int, test_fraction: float, random_state: Any, what: str = "rows", least: int = 1
) -> tuple[Ints, Ints]:
    """Random row numbers for training and for testing, each in ascending order.

    Args:
        count: number of rows.
        test_fraction: share to test on, at least 0 (train on all) and below 1; their number is
            rounded.
        random_state: None (a fixed seed), an int >= 0 or a Generator (one draw).
        what: what the rows are called in messages.
        least: fewest rows that each side needs.

    Raises:
        InputError: a share outside [0, 1), or one that leaves a side too few rows.

    Example:
        >>> train, test = split_rows(70, 0.3, random_state=1)
        >>> len(train), len(test)
        (49, 21)
    """
    share = test_fraction
    if isinstance(share, bool) or not isinstance(share, (int, float)) or not 0.0 <= share < 1.0:
        raise InputError(f"test_fraction must lie in [0, 1), got {share!r}")
    n_test = round(share * count)
    if count - n_test < least or (share > 0.0 and n_test < least):
        raise InputError(
            f"test_fraction={share:g} of {count} {what} leaves {count - n_test} to train and"
            f" {n_test} to test: each needs at least {least}"
        )
    order = np.random.default_rng(seed_of(random_state, "random_state")).permutation(count)
    return np.sort(order[n_test:]), np.sort(order[:n_test])
