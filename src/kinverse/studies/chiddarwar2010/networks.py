"""The networks of document 000 and readings of them."""

from typing import Any

from kinverse.networks import MLP, RBFNetwork
from kinverse.studies.chiddarwar2010.source import parameter

__all__ = ["AS_PRINTED", "CONSTANT", "FAMILY", "NETWORKS", "make_network"]

CONSTANT = "constant"
"""No network: the mean of what it is trained on, whatever the pose."""
SCALED = "RBF scaled (ours)"
AS_PRINTED = {"RBF": "RBF as printed", "MLP": "MLP"}
"""The network with the printed settings of each family."""
NETWORKS = ("RBF as printed", SCALED, "MLP")
FAMILY = {"RBF as printed": "RBF", SCALED: "RBF", "MLP": "MLP", CONSTANT: CONSTANT}
SCALED_SPREAD = 3.0


def make_network(name: str, epochs: int, random_state: int) -> Any:
    """A network of 68 hidden neurons, not trained.

    Args:
        name: "RBF as printed" (spread 0.75 in metres and radians, one neuron added after the other
            to a sum of squared errors of 0.001), "RBF scaled (ours)" (inputs scaled to [-1, 1],
            spread 3), "MLP" (log sigmoid, Levenberg-Marquardt with Bayesian regularisation),
            "constant".
        epochs: of the MLP, at most.
        random_state: of its first weights.
    """
    neurons = int(parameter("hidden neurons"))
    if name == "RBF as printed":
        return RBFNetwork(
            neurons,
            spread=parameter("RBF spread"),
            goal=parameter("RBF goal (sum of squared errors)"),
            goal_kind="sse",
            scaling=None,
        )
    if name == CONSTANT:
        from sklearn.dummy import DummyRegressor

        return DummyRegressor()
    if name == SCALED:
        return RBFNetwork(neurons, spread=SCALED_SPREAD)
    return MLP(
        (neurons,),
        activation="logsig",
        trainer="bayes",
        damping="nielsen",
        max_iter=epochs,
        random_state=random_state,
    )
