"""Paths: curves of poses, and what an arm can do along them.

>>> from kinverse.paths import Path
>>> Path.circle([0.6, 0.0, 0.5], 0.2, orientation="radial").sample(count=100).T.shape
(100, 4, 4)
"""

from kinverse.paths.orientation import Constant, Radial, Tangent
from kinverse.paths.path import Path, Samples

__all__ = ["Constant", "Path", "Radial", "Samples", "Tangent"]
