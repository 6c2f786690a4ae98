"""The units that the thesis prints lengths in."""

__all__ = ["METRES"]

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""One of a printed unit [m]."""
