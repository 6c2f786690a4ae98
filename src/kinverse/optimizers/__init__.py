"""Population methods for any objective: ask for points, tell their values. They know no robots.

>>> from kinverse.optimizers import GreyWolf, minimize
>>> minimize(lambda x: (x**2).sum(), [(-5, 5)] * 3, GreyWolf(), max_evals=5000).x

``make_optimizer("gwo")`` makes one by its short name; ``NAMES`` lists them.
"""

import typing

from kinverse.optimizers._base import Optimizer
from kinverse.optimizers.constraints import AtMost, Equal
from kinverse.optimizers.history import History
from kinverse.optimizers.lagrangian import Augmented, Penalty
from kinverse.optimizers.minimize import minimize
from kinverse.optimizers.registry import METHODS, NAMES, make_optimizer
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
    "AtMost",
    "Augmented",
    "BeesAlgorithm",
    "BiogeographyBased",
    "CrabIntelligence",
    "DifferentialEvolution",
    "Equal",
    "Firefly",
    "GeneticAlgorithm",
    "GreyWolf",
    "History",
    "NAMES",
    "Optimizer",
    "ParticleSwarm",
    "Penalty",
    "Run",
    "TeachingLearning",
    "make_optimizer",
    "minimize",
]

_LAZY = {name: f"kinverse.optimizers.methods.{file}" for name, file in METHODS.values()}


def __getattr__(name: str) -> typing.Any:
    if name in _LAZY:
        from importlib import import_module

        value = globals()[name] = getattr(import_module(_LAZY[name]), name)
        return value
    raise AttributeError(f"module 'kinverse.optimizers' has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
