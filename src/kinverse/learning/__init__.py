"""What networks are told of a robot: features of poses, virtual vectors, data sets.

>>> from kinverse.learning import PoseFeatures, sample
>>> data = sample(robot, 5000, random_state=0)
>>> X, y = data.inverse(PoseFeatures("xyz+matrix"))
"""

from kinverse.learning.data_set import DataSet, sample
from kinverse.learning.features import KINDS, PoseFeatures
from kinverse.learning.keep import far_from_singularity, inside_limits, one_branch, passing
from kinverse.learning.pairs import IncrementalPairs, PairSplit
from kinverse.learning.regression_table import RegressionTable, regression_table
from kinverse.learning.virtual_vector import VirtualVector

__all__ = [
    "KINDS",
    "DataSet",
    "IncrementalPairs",
    "PairSplit",
    "PoseFeatures",
    "RegressionTable",
    "VirtualVector",
    "far_from_singularity",
    "inside_limits",
    "one_branch",
    "passing",
    "regression_table",
    "sample",
]
