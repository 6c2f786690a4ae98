"""The methods by their short names; a method's file is imported when it is first asked for."""

import typing

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer

__all__ = ["METHODS", "NAMES", "make_optimizer"]

METHODS = {
    "pso": ("ParticleSwarm", "particle_swarm"),
    "ga": ("GeneticAlgorithm", "genetic_algorithm"),
    "gwo": ("GreyWolf", "grey_wolf"),
    "tlbo": ("TeachingLearning", "teaching_learning"),
    "bees": ("BeesAlgorithm", "bees_algorithm"),
    "cibo": ("CrabIntelligence", "crab_intelligence"),
    "abc": ("ArtificialBeeColony", "artificial_bee_colony"),
    "firefly": ("Firefly", "firefly"),
    "bbo": ("BiogeographyBased", "biogeography_based"),
    "de": ("DifferentialEvolution", "differential_evolution"),
}
"""Short name: class, file in methods/."""

NAMES = tuple(METHODS)
"""Short names of the methods."""


def make_optimizer(name: str, **settings: typing.Any) -> Optimizer:
    """A method by its short name.

    Raises:
        InputError: an unknown name; the message lists the names.
        TypeError: a setting that the method does not have.

    Example:
        >>> make_optimizer("pso", population=50)
        ParticleSwarm(population=50)
    """
    if not isinstance(name, str) or name not in METHODS:
        raise InputError(f"unknown optimizer {name!r}: the optimizers are {', '.join(NAMES)}")
    from importlib import import_module

    title, file = METHODS[name]
    method: Optimizer = getattr(import_module(f"kinverse.optimizers.methods.{file}"), title)(
        **settings
    )
    return method
