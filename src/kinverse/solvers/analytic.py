"""Closed forms: every branch of every pose, in one native call."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse import kernels
from kinverse.errors import NoClosedForm
from kinverse.robot import Robot
from kinverse.solvers._base import Proposal, Solver
from kinverse.solvers.families import ClosedFormSpec, Family, closed_form_spec

__all__ = ["Analytic"]

Array = NDArray[np.float64]

EXACT = 1e-9
"""Error [rad, and m for arms up to a metre] that rounding explains: a branch with more only just
misses the pose, and counts only if the pose has no exact branch."""


class Analytic(Solver):
    """Every branch in closed form, with labels, and the proof where there is none.

    Solves arms with a spherical wrist at either end (any shoulder and elbow in which axes 1 and 2,
    or 2 and 3, meet or are parallel), three consecutive parallel axes with axes 5 and 6 meeting
    (Universal Robots), the 5R arms that lack one axis of these, planar 3R arms and SCARA arms. No
    two axes need be perpendicular. Sources: Pieper (1968); thesis of Jha (2015), chapter 4, with
    the corrections of the project's errata.

    A pose that meets a continuum of solutions (a singular pose) gets, per branch, the member that
    lies inside the limits and nearest to ``q_seed`` (else to their middle), to about 1e-3 rad;
    ``stats.singular`` tells. UNREACHABLE is shown by interval arithmetic over all poses within
    the tolerances.

    Args:
        task: "pose".
        tol_position: largest position error [m].
        tol_rotation: largest rotation error [rad].
        windings: "nearest" or "all".
        limits: "hold" or "ignore".

    Raises:
        NoClosedForm: at ``fit``, if no family fits the robot or the task.

    Example:
        >>> solver = kv.Analytic().fit(kv.load("kr16"))
        >>> solver.solve(robot.fk(q)).branch_labels
    """

    spec_: ClosedFormSpec

    def __init__(
        self,
        *,
        task: str = "pose",
        tol_position: float = 1e-6,
        tol_rotation: float = 1e-6,
        windings: str = "nearest",
        limits: str = "hold",
    ) -> None:
        self.task = task
        self.tol_position = tol_position
        self.tol_rotation = tol_rotation
        self.windings = windings
        self.limits = limits

    def _fit(self, robot: Robot) -> None:
        if self.settings_.task != "pose":
            raise NoClosedForm(
                f"no closed form for task {self.settings_.task!r}: Analytic solves 'pose';"
                " use Numerical"
            )
        self.spec_ = closed_form_spec(robot)
        self.branch_labels_ = self.spec_.branch_labels

    def _bind(self) -> None:
        spec, settings = self.spec_, self.settings_
        tolerances = (
            float(settings.tol_position),
            float(settings.tol_rotation),
            settings.limits == "ignore",
            self._exact,
        )
        self._form: Any
        if spec.family is Family.GENERAL_6R:
            self._form = kernels.GeneralForm(self.robot_.chain, *tolerances)
        else:
            self._form = self._special_form(tolerances)
        if settings.windings == "nearest":
            self._fused = self._form.solve

    @property
    def _exact(self) -> float:
        return EXACT * max(1.0, self.spec_.size)

    def _special_form(self, tolerances: tuple[float, float, bool, float]) -> Any:
        spec = self.spec_
        links = spec.links
        alpha = np.arctan2(links.sin_alpha, links.cos_alpha)
        return kernels.ClosedForm(
            self.robot_.chain,
            int(spec.family),
            int(spec.regional),
            spec.is_reversed,
            spec.perpendicular_wrist,
            np.column_stack([links.a, links.d, alpha, links.cos_alpha, links.sin_alpha]),
            np.linalg.inv(links.base),
            np.linalg.inv(links.tool),
            spec.joint,
            links.sign,
            links.offset,
            *tolerances,
            spec.deviation(self.robot_),
        )

    def _propose(self, T: Array, q_seed: Array | None, seed: int) -> Proposal:
        q, pose_index, branch, hint, singular = self._form.propose(T, q_seed)
        return Proposal(
            q=q,
            pose_index=pose_index,
            branch=branch,
            hint=hint,
            evaluations=np.bincount(pose_index, minlength=len(T)),
            singular=singular,
            exact=self._exact,
        )
