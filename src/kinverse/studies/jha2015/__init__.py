"""P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, NIT Rourkela, 2015."""

import re

from kinverse.studies.jha2015 import (
    conventional,
    flags,
    forward_tables,
    free_lengths,
    networks,
    swarm,
)
from kinverse.studies.jha2015.conventional import POSES_SEED
from kinverse.studies.jha2015.networks.sets import DATA_SEED, FLOOR_SEED
from kinverse.studies.jha2015.networks.training import NETWORK_SEED
from kinverse.studies.jha2015.swarm.search import REFERENCE_SEED, SEARCH_SEED
from kinverse.studies.study import Study
from kinverse.studies.table import TableSpec

__all__ = ["STUDY"]

TABLES = (
    *forward_tables.TABLES,
    *free_lengths.TABLES,
    *flags.TABLES,
    *networks.TABLES,
    *swarm.TABLES,
    *conventional.TABLES,
)


def _place(spec: TableSpec) -> int:
    """Number of a table in the document; figures come first, additions of ours last."""
    if spec.name.startswith("fig-"):
        return 0
    numbered = re.match(r"7\.(\d+)", spec.name)
    return int(numbered[1]) if numbered else len(TABLES)


STUDY = Study(
    name="jha2015",
    title="Inverse kinematic analysis of robot manipulators",
    source="P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, National"
    " Institute of Technology Rourkela, 2015",
    tables=tuple(sorted(TABLES, key=_place)),
    seeds={
        "rows of networks": f"{DATA_SEED} + seed",
        "first weights": f"{NETWORK_SEED} + seed",
        "rows of the least errors": f"{DATA_SEED} + {FLOOR_SEED} and one more",
        "searches": f"{SEARCH_SEED} with the key (position, seed)",
        "descents to the nearest solution": f"{REFERENCE_SEED}",
        "poses of table 7.39": f"{POSES_SEED}",
        "times of table 7.41": f"{SEARCH_SEED} with the key (position, 0)",
    },
)
