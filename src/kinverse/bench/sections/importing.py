"""How long ``import kinverse`` takes, beside numpy, in fresh processes."""

import subprocess
import sys
import time

from kinverse.bench.report import Line
from kinverse.bench.run import Spread

__all__ = ["import_time"]

STATEMENTS = {"bare": "pass", "numpy": "import numpy", "kinverse": "import kinverse"}


def import_time(quick: bool) -> list[Line]:
    """Median of 15 fresh processes each, in turn, the bare interpreter subtracted."""
    rounds = 5 if quick else 15
    taken: dict[str, list[float]] = {name: [] for name in STATEMENTS}
    for k in range(rounds + 1):
        for name, statement in STATEMENTS.items():
            start = time.perf_counter()
            subprocess.run([sys.executable, "-c", statement], check=True)
            if k:  # the first round warms the file cache
                taken[name].append(time.perf_counter() - start)
    medians = {name: Spread.of(values) for name, values in taken.items()}
    bare = medians["bare"].median
    numpy = medians["numpy"].median - bare
    ours = medians["kinverse"].median - bare
    note = f"ms: kinverse {1e3 * ours:.0f}, numpy {1e3 * numpy:.0f}, bare {1e3 * bare:.0f}"
    figure = Spread.exact(ours / numpy)
    return [Line("import", "-", "import kinverse / import numpy", figure, 1.5, False, note)]
