"""Chapter 7.4: population methods on five positions of each arm."""

from kinverse.studies.jha2015.swarm import times, values

__all__ = ["TABLES"]

TABLES = (*values.TABLES, *times.TABLES)
