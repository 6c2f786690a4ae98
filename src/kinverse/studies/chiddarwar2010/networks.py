"""The networks of document 000 and readings of them."""

from typing import Any

from kinverse.networks import MLP, RBFNetwork
from kinverse.studies.chiddarwar2010.source import parameter

__all__ = ["FAMILY", "NETWORKS", "make_network"]

NETWORKS = ("RBF as printed", "RBF scaled", "MLP")
FAMILY = {"RBF as printed": "RBF", "RBF scaled": "RBF", "MLP": "MLP"}
SCALED_SPREAD = 3.0


def make_network(name: str, epochs: int, random_state: int) -> Any:
    """A network of 68 hidden neurons, not trained.

    Args:
        name: "RBF as printed" (spread 0.75 in metres and radians, one neuron added after the other
            to a sum of squared errors of 0.001), "RBF scaled" (inputs scaled to [-1, 1], spread 3),
            "MLP" (log sigmoid, Levenberg-Marquardt with Bayesian regularisation).
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
    if name == "RBF scaled":
        return RBFNetwork(neurons, spread=SCALED_SPREAD)
    return MLP(
        (neurons,),
        activation="logsig",
        trainer="bayes",
        damping="nielsen",
        max_iter=epochs,
        random_state=random_state,
    )
