"""How long it takes to get ready for an arm: no derivation, no build."""

from collections.abc import Iterator
from functools import partial

import kinverse as kv
from kinverse.bench import arms
from kinverse.bench.report import Line
from kinverse.bench.run import Spread, alternate
from kinverse.load import names

__all__ = ["fit_time"]

BOUND = 10.0
"""Target of every arm [ms]."""

Fits = Iterator[tuple[str, kv.Robot, kv.Analytic]]


def fit_time(quick: bool) -> list[Line]:
    """Median of the fits of each arm; the slowest arm of each group."""
    rounds = 7 if quick else 15
    return [line for group, fits in _groups().items() for line in _slowest(group, fits, rounds)]


def _groups() -> dict[str, Fits]:
    six = arms.SIX | arms.TODAY | arms.ALMOST
    return {
        "catalogue": ((name, kv.load(name), kv.Analytic()) for name in names()),
        "six turning joints": ((name, make(), kv.Analytic()) for name, make in six.items()),
        "slides": (
            (name, make(), kv.Analytic()) for name, make in (arms.SLIDING | arms.SQUARE).items()
        ),
        "one to five joints": ((name, make(), kv.Analytic()) for name, make in arms.SHORT.items()),
        "seven joints": _seven(),
    }


def _seven() -> Fits:
    for name, make in (arms.SEVEN | {"general RRRRRRR": arms.random_seven}).items():
        robot = make()
        for joint in (None, *range(robot.dof)):
            held = f" joint {joint}" if joint is not None else ""
            yield f"{name}{held}", robot, kv.Analytic(redundancy=joint)


def _slowest(group: str, fits: Fits, rounds: int) -> list[Line]:
    spreads, refused = {}, []
    for name, robot, solver in fits:
        try:
            taken = alternate({"fit": partial(solver.fit, robot)}, rounds)["fit"]
        except kv.NoClosedForm:
            refused.append(name)
            continue
        spreads[name] = Spread.of([1e3 * seconds for seconds in taken])
    slowest = max(spreads, key=lambda name: spreads[name].median)
    head = ("fit", group)
    note = f"{slowest}, of {len(spreads)} arms"
    named = f"no closed form: {', '.join(refused)}" if refused else ""
    return [
        Line(*head, "slowest arm: ms", spreads[slowest], BOUND, False, note),
        Line(*head, "arms refused", Spread.exact(len(refused)), note=named),
    ]
