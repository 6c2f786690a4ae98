"""The one door to the native core: nothing else in kinverse imports ``kinverse._core``.

Behind it live arrays and status codes only; names, files and policy stay in Python.
"""

from kinverse._core import (
    Chain,
    ClosedForm,
    GeneralForm,
    LeastSquares,
    Redundant,
    Table,
    evidence_type,
    instruction_set,
    instruction_sets,
    set_instruction_set,
    set_threads,
    shortest_path,
    threads,
    verify,
    winding_counts,
    windings,
)

__all__ = [
    "EVIDENCE",
    "Chain",
    "ClosedForm",
    "GeneralForm",
    "LeastSquares",
    "Redundant",
    "Table",
    "instruction_set",
    "instruction_sets",
    "set_instruction_set",
    "set_threads",
    "shortest_path",
    "threads",
    "verify",
    "winding_counts",
    "windings",
]

EVIDENCE = evidence_type()
