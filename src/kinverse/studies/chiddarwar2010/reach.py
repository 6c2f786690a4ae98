"""In which region a printed range of errors is met, and whether that says something.

Errors shrink with the region, so in a small one anything is below a printed number: a predictor
that says the same joint values for every pose is, too. A region tells something only where that
predictor is above the range.
"""

from collections.abc import Iterable
from enum import Enum
from typing import NamedTuple

from kinverse.studies.chiddarwar2010.poses import REGIONS, WHOLE, region_name
from kinverse.studies.chiddarwar2010.regions import ByRegion
from kinverse.studies.table import Verdict

__all__ = ["How", "Reach", "reached", "verdict"]


class How(Enum):
    """How errors compare with a printed range."""

    WHOLE = "inside the printed range"
    PART = "inside the printed range there"
    BETWEEN = "below the printed range in the smaller, above it in the wider"
    BELOW = "below the printed range in every region tried"
    TRIVIAL = "no region where the constant predictor does not reach it too"
    ABOVE = "above the printed range in every region tried"


class Reach(NamedTuple):
    """Where a printed range is met.

    Attributes:
        where: the region, two regions the range lies between, or "none of them".
        how: what holds there.
        open: it is not above the range in the widest region tried, and wider ones were not tried.
    """

    where: str
    how: How
    open: bool

    def __str__(self) -> str:
        return f"{self.where} ({self.how.value})"


def reached(found: ByRegion, printed: tuple[float, float], constant: ByRegion) -> Reach:
    """Where medians are inside a printed range, the constant predictor's being above it.

    Args:
        found: errors by region.
        printed: least and greatest printed number, in the same unit.
        constant: errors of the constant predictor by region.
    """
    halves = [half for half in REGIONS if half in found]
    low, high = printed
    met: list[float] = []
    for half in halves:
        if found[half].median > high:
            break
        met.append(half)
    telling = [half for half in met if constant[half].median > high]
    inside = [half for half in telling if found[half].median >= low]
    beyond = halves[len(met) : len(met) + 1]
    left = not beyond and halves[-1] != WHOLE
    if inside:
        how = How.WHOLE if inside[-1] == WHOLE else How.PART
        return Reach(region_name(inside[-1]), how, left)
    if telling and beyond:
        ends = f"between {region_name(telling[-1])} and {region_name(beyond[0])}"
        return Reach(ends, How.BETWEEN, left)
    if telling:
        return Reach(region_name(telling[-1]), How.BELOW, left)
    return Reach("none of them", How.TRIVIAL if met else How.ABOVE, left)


def verdict(found: Iterable[Reach]) -> Verdict:
    """Of where each printed range is met; the document takes the whole workspace."""
    every = list(found)
    if all(each.how is How.WHOLE for each in every):
        return Verdict.REPRODUCED
    missed = [each for each in every if each.how in (How.ABOVE, How.TRIVIAL, How.BELOW)]
    if any(not each.open for each in missed):
        return Verdict.NOT_REPRODUCED
    return Verdict.CANNOT_CHECK if missed else Verdict.OTHER_READING
