"""Population methods for any objective: ask for points, tell their values. They know no robots.

>>> from kinverse.optimizers import GreyWolf, minimize
>>> minimize(lambda x: (x**2).sum(), [(-5, 5)] * 3, GreyWolf(), max_evals=5000).x

``make_optimizer("gwo")`` makes one by its short name; ``NAMES`` lists them.
"""

import typing

from kinverse.errors import InputError
from kinverse.optimizers._base import Optimizer
from kinverse.optimizers.run import Run

if typing.TYPE_CHECKING:
    from kinverse.optimizers.methods.artificial_bee_colony import ArtificialBeeColony
    from kinverse.optimizers.methods.bees_algorithm import BeesAlgorithm
    from kinverse.optimizers.methods.biogeography_based import BiogeographyBased
    from kinverse.optimizers.methods.crab_intelligence import CrabIntelligence
    from kinverse.optimizers.methods.differential_evolution import DifferentialEvolution
    from kinverse.optimizers.methods.firefly import Firefly
    from kinverse.optimizers.methods.genetic_algorithm import GeneticAlgorithm
    from kinverse.optimizers.methods.grey_wolf import GreyWolf
    from kinverse.optimizers.methods.particle_swarm import ParticleSwarm
    from kinverse.optimizers.methods.teaching_learning import TeachingLearning

__all__ = [
    "ArtificialBeeColony",
    "BeesAlgorithm",
    "BiogeographyBased",
    "CrabIntelligence",
    "DifferentialEvolution",
    "Firefly",
    "GeneticAlgorithm",
    "GreyWolf",
    "NAMES",
    "Optimizer",
    "ParticleSwarm",
    "Run",
    "TeachingLearning",
    "make_optimizer",
]

# short name: class, file in methods/
_METHODS = {
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
NAMES = tuple(_METHODS)
"""Short names of the methods."""

_LAZY = {name: f"kinverse.optimizers.methods.{file}" for name, file in _METHODS.values()}


def make_optimizer(name: str, **settings: typing.Any) -> Optimizer:
    """A method by its short name.

    Raises:
        InputError: an unknown name; the message lists the names.
        TypeError: a setting that the method does not have.

    Example:
        >>> make_optimizer("pso", population=50)
        ParticleSwarm(population=50)
    """
    if name not in _METHODS:
        raise InputError(f"unknown optimizer {name!r}: the optimizers are {', '.join(NAMES)}")
    method: Optimizer = __getattr__(_METHODS[name][0])(**settings)
    return method


def __getattr__(name: str) -> typing.Any:
    if name in _LAZY:
        from importlib import import_module

        value = globals()[name] = getattr(import_module(_LAZY[name]), name)
        return value
    raise AttributeError(f"module 'kinverse.optimizers' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
