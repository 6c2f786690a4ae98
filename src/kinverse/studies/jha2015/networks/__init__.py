"""Chapters 7.2 and 7.3: networks from positions to joints, plain and hybrid."""

from kinverse.studies.jha2015.networks import (
    configurations,
    hybrid,
    named,
    planar,
    printed_answers,
    times,
)

__all__ = ["TABLES"]

TABLES = (
    *planar.TABLES,
    *configurations.TABLES,
    *printed_answers.TABLES,
    *named.TABLES,
    *hybrid.TABLES,
    *times.TABLES,
)
