"""Timing side by side: A B A B in rounds, so that a slow minute hits both alike."""

import gc
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

__all__ = ["Spread", "alternate", "latencies", "quiet", "ratios"]


@dataclass(frozen=True)
class Spread:
    """A measured figure: the median of its rounds, and their range."""

    median: float
    low: float
    high: float

    @classmethod
    def of(cls, values: list[float]) -> "Spread":
        """The spread of some rounds."""
        return cls(statistics.median(values), min(values), max(values))

    @classmethod
    def exact(cls, value: float) -> "Spread":
        """A figure that is counted, not timed."""
        return cls(value, value, value)

    def __str__(self) -> str:
        if self.low == self.high or self.median != self.median:
            return _short(self.median)
        return f"{_short(self.median)} [{_short(self.low)}..{_short(self.high)}]"


def _short(value: float) -> str:
    if value != value:
        return "not measured"
    if value == 0.0:
        return "0"
    if abs(value) < 1e-3:
        return f"{value:.1e}"
    return f"{value:,.0f}" if abs(value) >= 1e4 or value == round(value) else f"{value:.4g}"


@contextmanager
def quiet() -> Iterator[None]:
    """No garbage collection while the clock runs."""
    was = gc.isenabled()
    gc.collect()
    gc.disable()
    try:
        yield
    finally:
        if was:
            gc.enable()


def alternate(tasks: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, list[float]]:
    """Wall seconds of each task in each round; the order is turned about every round."""
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    for task in tasks.values():
        task()
    names = list(tasks)
    with quiet():
        for k in range(rounds):
            for name in names if k % 2 == 0 else names[::-1]:
                start = time.perf_counter_ns()
                tasks[name]()
                seconds[name].append(1e-9 * (time.perf_counter_ns() - start))
    return seconds


def latencies(
    calls: Mapping[str, Callable[..., object]],
    inputs: Sequence[tuple[object, ...]],
    block: int = 500,
) -> tuple[dict[str, NDArray[np.float64]], dict[str, list[object]]]:
    """Time every single call, in alternating blocks.

    Args:
        calls: name -> what is called with each of the inputs.
        inputs: the arguments of each call.
        block: calls in a row before the other's turn.

    Returns:
        Wall seconds, name -> (count,), and the answers, name -> list.
    """
    count = len(inputs)
    taken = {name: np.empty(count) for name in calls}
    answers: dict[str, list[object]] = {name: [] for name in calls}
    clock = time.perf_counter_ns
    names = list(calls)
    for name in names:
        for given in inputs[:20]:
            calls[name](*given)
    with quiet():
        for k, start in enumerate(range(0, count, block)):
            for name in names if k % 2 == 0 else names[::-1]:
                call, out, kept = calls[name], taken[name], answers[name]
                for i in range(start, min(start + block, count)):
                    given = inputs[i]
                    t = clock()
                    answer = call(*given)
                    out[i] = 1e-9 * (clock() - t)
                    kept.append(answer)
    return taken, answers


def ratios(above: list[float], below: list[float]) -> Spread:
    """Round by round quotients."""
    return Spread.of([a / b for a, b in zip(above, below, strict=True)])
