"""A training that shows how far it is and that Ctrl-C ends without loss."""

import signal
import threading
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from rich.markup import escape
from rich.progress import Progress

from kinverse.cli._show import note, notes

__all__ = ["Session"]


QUIET = 10.0
"""Where no bar can be shown, a line tells how far it is after so many seconds."""


class Session:
    """The ``progress`` of a trained solver.

    Ctrl-C before the first network is begun ends the command; later the networks keep what they
    have learned, those that follow have one epoch each, and a second Ctrl-C does not wait for the
    epoch to end.

    Attributes:
        interrupted: Ctrl-C ended the training.
    """

    def __init__(self) -> None:
        self.interrupted = False
        self._training = False
        screen = notes()
        self._bar = Progress(console=screen, transient=True, disable=not screen.is_terminal)
        self._job = self._bar.add_task("", total=1.0)
        self._told = time.monotonic()

    def __call__(self, text: str, share: float) -> bool:
        """Show how far it is; True asks the training to end."""
        self._training = share < 1.0 and text != "examples"
        self._bar.update(self._job, completed=share, description=escape(text))
        if self._bar.disable and time.monotonic() - self._told > QUIET:
            note(f"{share:4.0%} {text}")
            self._told = time.monotonic()
        return self.interrupted

    @contextmanager
    def watching(self) -> Iterator[None]:
        """Within it the bar is shown, Ctrl-C is ours, and warnings become remarks."""
        with warnings.catch_warnings(record=True) as caught, _on_interrupt(self._interrupt):
            warnings.simplefilter("always", UserWarning)
            with self._bar:
                yield
        for text in dict.fromkeys(str(warning.message) for warning in caught):
            note(text)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if not self._training or self.interrupted:
            raise KeyboardInterrupt
        self.interrupted = True


@contextmanager
def _on_interrupt(handler: Callable[[int, FrameType | None], Any]) -> Iterator[None]:
    """Another answer to Ctrl-C, where this thread may give one."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)
