"""Chapters 7.2 and 7.3: networks from positions to joints, plain and hybrid."""

from kinverse.studies.jha2015.networks import hybrid, named, planar, times

__all__ = ["TABLES"]

TABLES = (*planar.TABLES, *named.TABLES, *hybrid.TABLES, *times.TABLES)
