"""Cells and a study for the tests of the runner."""

import os
import time
from pathlib import Path

from kinverse.studies.cell import Cell
from kinverse.studies.study import Study
from kinverse.studies.table import Table, TableSpec, Verdict


def squares(n, log):
    """Every call leaves a line in the log: tests count the calls."""
    with Path(log).open("a") as file:
        file.write(f"{n}\n")
    return [{"n": n, "square": n * n, "root": n**0.5, "name": f"n{n}", "none": None}]


def squares_but_three(n, log):
    if n == 3:
        raise ArithmeticError("three is refused")
    return squares(n, log)


def interrupted_at_two(n, log):
    if n == 2 and not Path(log).with_suffix(".again").exists():
        raise KeyboardInterrupt
    return squares(n, log)


def ends_its_process(n, log):
    os._exit(3)


def threads(n, log):
    import numpy as np
    from threadpoolctl import threadpool_info

    np.ones((4, 4)) @ np.ones((4, 4))
    return [{"threads": max(pool["num_threads"] for pool in threadpool_info())}]


def slow(n, log):
    time.sleep(0.05 * n)
    return squares(n, log)


def returns_nan(n, log):
    return [{"value": float("nan")}]


def returns_an_array(n, log):
    import numpy as np

    return [{"value": np.zeros(3)}]


def cells(function, log, count=5):
    return [
        Cell(f"{function.__name__}-{n}", function, {"n": n, "log": str(log)}) for n in range(count)
    ]


def table_of(name, cells_of, verdict=Verdict.OURS):
    def build(rows):
        every = [row for cell in sorted(rows) for row in rows[cell]]
        return Table(f"table {name}", every, verdict, "0 mm at most")

    return TableSpec(name, f"Table {name}", lambda quick: cells_of, build)


def study_of(*specs, name="toy"):
    return Study(name, "A toy", "Nobody, Nothing, 2000", specs)
