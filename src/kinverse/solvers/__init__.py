"""Solvers: each proposes candidates, the base class verifies them."""

from kinverse.solvers._base import Proposal, Solver
from kinverse.solvers.compose import FirstOf, Seeded
from kinverse.solvers.registry import make_solver, solver_names

__all__ = ["FirstOf", "Proposal", "Seeded", "Solver", "make_solver", "solver_names"]
