"""Chapters 7.2 and 7.3: networks from positions to joints, plain and hybrid."""

from kinverse.studies.jha2015.networks import (
    configurations,
    hybrid,
    planar,
    printed_answers,
    scara_5r,
    times,
)

__all__ = ["TABLES"]

TABLES = (
    *planar.TABLES,
    *configurations.TABLES,
    *printed_answers.TABLES,
    *scara_5r.TABLES,
    *hybrid.TABLES,
    *times.TABLES,
)
