"""The exceptions kinverse raises on purpose.

KinverseError
    InputError (also ValueError)        a bad argument: a pose, an array, a setting, a name
        ModelError                      a robot file or definition that cannot be used
    NoClosedForm                        Analytic.fit: no closed-form family fits the robot
    NoSolution                          Solutions.raise_if_none: at least one pose has no answer
    MissingExtra (also ImportError)     an optional package is not installed

Complex, object and text arrays are a plain ``TypeError``, and so is an unknown keyword.
"""

__all__ = [
    "InputError",
    "KinverseError",
    "MissingExtra",
    "ModelError",
    "NoClosedForm",
    "NoSolution",
]


class KinverseError(Exception):
    """Base of every exception that kinverse raises on purpose."""


class InputError(KinverseError, ValueError):
    """An argument cannot be used; the message says which, where and what is valid."""


class ModelError(InputError):
    """A robot file or definition cannot be used; the message names the file and the part."""


class NoClosedForm(KinverseError):
    """No closed-form family fits the robot; the message says what was looked for."""


class NoSolution(KinverseError):
    """At least one pose has no solution and the caller asked for an exception."""


class MissingExtra(KinverseError, ImportError):
    """An optional package is missing; the message is the pip command that installs it.

    Args:
        feature: what was asked for, in the reader's words.
        extra: name of the kinverse extra that brings it.
    """

    def __init__(self, feature: str, extra: str) -> None:
        self.feature, self.extra = feature, extra
        super().__init__(f'{feature} needs an optional package: pip install "kinverse[{extra}]"')

    def __reduce__(self) -> tuple[type["MissingExtra"], tuple[str, str]]:
        return type(self), (self.feature, self.extra)
