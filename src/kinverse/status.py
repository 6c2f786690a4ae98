"""What is known of a pose after a solver has looked at it."""

from enum import IntEnum

__all__ = ["Status"]


class Status(IntEnum):
    """What is known of one pose; ``text`` says it in a sentence.

    Example:
        >>> Status.OUT_OF_LIMITS.text
        'solutions exist, none inside the joint limits'
    """

    SOLVED = 0
    OUT_OF_LIMITS = 1
    UNREACHABLE = 2
    NOT_FOUND = 3

    @property
    def text(self) -> str:
        """One sentence for people."""
        return _TEXTS[self]


_TEXTS = (
    "at least one verified solution",
    "solutions exist, none inside the joint limits",
    "shown that no joint values meet the tolerances, limits ignored",
    "no solution was kept and none was shown to be impossible",
)
