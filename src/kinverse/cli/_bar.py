"""How far long work is: a bar on a terminal, else a line now and then."""

import time

from rich.markup import escape
from rich.progress import Progress

from kinverse.cli._show import note, notes

__all__ = ["Bar"]

QUIET = 10.0
"""Where no bar can be shown, a line tells how far it is after so many seconds."""


class Bar:
    """Shown while a ``with`` block runs; call it with a text and the share that is done."""

    def __init__(self, text: str = "") -> None:
        screen = notes()
        self._bar = Progress(console=screen, transient=True, disable=not screen.is_terminal)
        self._job = self._bar.add_task(escape(text), total=1.0)
        self._told = time.monotonic()

    def __enter__(self) -> "Bar":
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._bar.stop()

    def __call__(self, text: str, share: float) -> None:
        """Show how far it is."""
        self._bar.update(self._job, completed=share, description=escape(text))
        if self._bar.disable and time.monotonic() - self._told > QUIET:
            note(f"{share:4.0%} {text}")
            self._told = time.monotonic()
