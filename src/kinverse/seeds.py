"""What a caller's ``rng`` comes to: one whole number."""

from typing import Any

import numpy as np

from kinverse.errors import InputError

__all__ = ["seed_of"]


def seed_of(rng: Any, name: str = "rng") -> int:
    """A seed of 63 bits; a Generator is drawn from once.

    Args:
        rng: None (0), an int >= 0 or a Generator.
        name: how the argument is called in messages.

    Raises:
        InputError: a number that is no seed.
        TypeError: anything else.

    Example:
        >>> seed_of(7)
        7
    """
    if rng is None:
        return 0
    if isinstance(rng, (int, np.integer)) and not isinstance(rng, bool):
        if 0 <= rng < 2**63:
            return int(rng)
        raise InputError(f"{name} as a seed must lie in 0..2**63-1, got {rng}")
    if isinstance(rng, np.random.Generator):
        return int(rng.integers(2**63))
    raise TypeError(f"{name} must be None, an int or a numpy Generator, got {type(rng).__name__}")
