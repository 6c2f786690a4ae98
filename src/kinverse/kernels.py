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
    threads,
    verify,
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
    "threads",
    "verify",
]

EVIDENCE = evidence_type()
