"""Which method to use when: a sentence for each situation, from its figures."""

from collections.abc import Iterable
from typing import Any

from kinverse.studies.cell import Row
from kinverse.studies.summary.methods import ALONE, NETWORK

__all__ = ["ENOUGH", "answer"]

ENOUGH = 99.0
"""Share of the targets [%] that a method must solve on every arm to be recommended."""


def answer(situation: str, rows: list[Row], arms: Iterable[str] = ()) -> Row:
    """The recommendation of one situation.

    The quickest method that solves enough on every arm is the one to use; the one with most
    solutions a pose of those is for every branch.

    Args:
        situation: its name.
        rows: of ``tables.by_situation``, those of this situation.
        arms: its arms.
    """
    sound = [row for row in rows if _is_sound(row)]
    by_name = {str(row["method"]): row for row in rows}
    first = min(sound, key=_milliseconds, default=None)
    most = max(sound, key=lambda row: _value(row, "solutions a pose"), default=None)
    parts = [f"{first['method']}: {_told(first)}" if first else _none(rows)]
    has_many = most is not None and _value(most, "solutions a pose") > 1.5
    if first and most and has_many:
        every = f"every branch ({_value(most, 'solutions a pose'):.2g} solutions a pose)"
        parts.append(
            f"it gives {every}"
            if most is first
            else f"for {every} {most['method']}, {_time(most)} a pose"
        )
    others = [row for row in sound if row is not first and not (has_many and row is most)]
    if others:
        next_one = min(others, key=_milliseconds)
        parts.append(f"next {next_one['method']}, {_time(next_one)}")
    swarms = [by_name[name] for name in ALONE if name in by_name]
    best = max(swarms, key=lambda row: (_value(row, "solved, %"), -_milliseconds(row)))
    parts.append(
        f"of the population methods alone {best['method']} solves most,"
        f" a median of {_value(best, 'solved, %'):.3g} % in {_time(best)}"
    )
    parts.append(f"a network alone is {_off(by_name[NETWORK])} off")
    return {
        "situation": situation,
        "arms": ", ".join(arms),
        "use": first["method"] if first else None,
        "call": first["call"] if first else None,
        "for every branch": most["method"] if most and has_many else None,
        "answer": f"Where {_where(situation)}, use {'; '.join(parts)}.",
    }


def _off(row: Row) -> str:
    far, turned = row["position error, median, % of reach"], row["rotation error, median, deg"]
    told = f"{_float(far, float('inf')):.3g} % of the arm's reach"
    return told if turned is None else f"{told} and {_float(turned, 0.0):.3g} deg"


def _where(situation: str) -> str:
    return {
        "closed form exists": "a closed form exists",
        "redundant": "the arm is redundant",
        "no closed form": "there is no closed form",
        "position only": "only the position counts",
    }[situation]


def _is_sound(row: Row) -> bool:
    lowest = row["solved, lowest of an arm, %"]
    return row["arms it applies to"] == row["arms"] and _float(lowest, 0.0) >= ENOUGH


def _told(row: Row) -> str:
    lowest = _float(row["solved, lowest of an arm, %"], 0.0)
    share = "all" if lowest == 100.0 else f"{lowest:.3g} % or more"
    return f"{share} of the targets solved on every arm, {_time(row)} a pose"


def _none(rows: list[Row]) -> str:
    best = max(rows, key=lambda row: _float(row["solved, lowest of an arm, %"], 0.0))
    return f"with care {best['method']}: no method solves {ENOUGH:g} % on every arm, it comes next"


def _time(row: Row) -> str:
    ms = _milliseconds(row)
    return f"{ms:.2g} ms" if ms >= 0.1 else f"{1e3 * ms:.2g} us"


def _milliseconds(row: Row) -> float:
    return _value(row, "time a pose, ms")


def _value(row: Row, column: str) -> float:
    return _float(row[column], float("inf"))


def _float(value: Any, otherwise: float) -> float:
    return otherwise if value is None else float(value)
