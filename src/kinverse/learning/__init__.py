"""What networks read and learn of robots: features of poses, and data sets by forward kinematics.

>>> from kinverse.learning import PoseFeatures, far_from_singularity, sample
>>> data = sample(robot, 1000, random_state=1, keep=far_from_singularity(robot))
>>> train, test = data.split(0.2)
>>> features = PoseFeatures("xyz+matrix").fit(train.T)
>>> X, y = train.inverse(features)
"""

from kinverse.learning.data_set import DataSet, passing, sample
from kinverse.learning.features import PoseFeatures
from kinverse.learning.keep import (
    Predicate,
    branch_of,
    collision_free,
    far_from_singularity,
    inside_limits,
    one_branch,
)
from kinverse.learning.pairs import IncrementalPairs, PairSet, pair_inputs
from kinverse.learning.regression_table import RegressionTable, regression_table
from kinverse.learning.virtual_vector import VirtualVector

__all__ = [
    "DataSet",
    "IncrementalPairs",
    "PairSet",
    "PoseFeatures",
    "Predicate",
    "RegressionTable",
    "VirtualVector",
    "branch_of",
    "collision_free",
    "far_from_singularity",
    "inside_limits",
    "one_branch",
    "pair_inputs",
    "passing",
    "regression_table",
    "sample",
]
