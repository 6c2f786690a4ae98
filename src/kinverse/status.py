"""What is known of a pose after a solver has looked at it."""

from enum import IntEnum

__all__ = ["METHODS", "STOPS", "Status"]

METHODS = ("search", "sweep", "closed form", "elimination", "bounds")
"""What found the solutions of a pose, or showed that there are none, in the native core's order;
``Evidence.method`` says what each is worth."""

STOPS = ("residual", "step", "jacobian", "stalled", "iterations", "diverged", "limits")
"""Why the start of an iteration ended, in the native core's order: the residual, the step or the
gradient J^T e fell below its tolerance; the error stopped falling; the steps ran out; the numbers
left all bounds; the joint limits were missed at the end."""


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
    "the search found none (or a filter kept none); that does not show that there is none",
)
