"""P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, NIT Rourkela, 2015."""

from kinverse.studies.jha2015 import flags, forward_tables, free_lengths
from kinverse.studies.study import Study

__all__ = ["STUDY"]

STUDY = Study(
    name="jha2015",
    title="Inverse kinematic analysis of robot manipulators",
    source="P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, National"
    " Institute of Technology Rourkela, 2015",
    tables=(*forward_tables.TABLES, *free_lengths.TABLES, *flags.TABLES),
)
