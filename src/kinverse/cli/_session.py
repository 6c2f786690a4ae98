"""A training that shows how far it is and that Ctrl-C ends without loss."""

import signal
import threading
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any

from kinverse.cli._bar import Bar
from kinverse.cli._show import note

__all__ = ["Session"]


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
        self._bar = Bar()

    def __call__(self, text: str, share: float) -> bool:
        """Show how far it is; True asks the training to end."""
        self._training = share < 1.0 and text != "examples"
        self._bar(text, share)
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
