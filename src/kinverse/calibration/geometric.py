"""The geometry of the real arm, found from measurements."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from kinverse import se3
from kinverse.calibration._base import ErrorModel
from kinverse.calibration.link_errors import (
    COMPONENTS,
    gear_waves,
    identification_jacobian,
    independent,
    with_link_errors,
)
from kinverse.calibration.tool_errors import tool_error
from kinverse.errors import InputError
from kinverse.geometry import axis_lines
from kinverse.networks._base import check_number, check_whole
from kinverse.robot import Robot

__all__ = ["GeometricErrorModel"]

Array = NDArray[np.float64]

MOST_HARMONICS = 20


class GeometricErrorModel(ErrorModel):
    """The link frames themselves, by nonlinear least squares on what was measured.

    Every fixed transform of the chain gets six small errors; those that the measurements cannot
    tell apart are held at zero, found by the rank of the identification Jacobian at the nominal
    geometry (Hollerbach & Wampler, Int. J. Robotics Research 15(6), 1996). So parallel axes are
    nothing special (to DH parameters they are: Hayati & Mirmirani 1985), and a base frame that is
    not quite where the measuring device takes it to be is found with the rest. Measured poses show
    four errors for each revolute joint, two for each slide, and six; positions show fewer.

    With ``harmonics`` each revolute joint also stands off by a Fourier polynomial of its own
    angle, as gears make it: document 002, equation (24), at the joint instead of the tool.

    Args:
        robot: as it is said to be; errors are counted against it.
        harmonics: of the gear errors; 0: none.
        tolerance: share of a parameter's effect that the others must not explain, or it is held.
        length: metres that a radian counts in the residual of measured rotations; None: the sum
            of the arm's lengths.

    Attributes:
        errors_: (m + 1, 6) x, y, z [m], rx, ry, rz [rad] of each frame of ``robot.frames``.
        gear_: (n, 2 h) [rad] weights of cos q, sin q, cos 2q, sin 2q ... of each joint.
        standard_errors_: (m + 1, 6) of ``errors_``, by the residual; NaN of those held, and
            everywhere without measurements to spare.
        identified_: (m + 1, 6) which of ``errors_`` were found; the others were held at zero.
        nominal_: the robot that errors are counted against.

    Example:
        >>> model = GeometricErrorModel(robot).fit(q, tool_error(robot, q, positions))
        >>> model.robot_.to_dh().a
    """

    def __init__(
        self,
        robot: Robot,
        *,
        harmonics: int = 0,
        tolerance: float = 1e-3,
        length: float | None = None,
    ) -> None:
        self.robot = robot
        self.harmonics = harmonics
        self.tolerance = tolerance
        self.length = length

    @property
    def robot_(self) -> Robot:
        """The corrected robot: the link errors put in, gear errors left out."""
        return with_link_errors(self.nominal_, self.errors_)

    @property
    def parameters_(self) -> tuple[str, ...]:
        """Names of the link errors that were found, such as "joint2 ry", frame by frame."""
        # a frame is called after the joint it carries, the last one after the tool
        names = [*(self.nominal_.joint_names[j] for j in self.nominal_.source.tolist()), "tool"]
        found = np.argwhere(self.identified_).tolist()
        return tuple(f"{names[i]} {COMPONENTS[k]}" for i, k in found)

    def _check_settings(self) -> None:
        if not isinstance(self.robot, Robot):
            raise InputError(f"robot must be a kinverse.Robot, got {self.robot!r}")
        check_whole("harmonics", self.harmonics, 0)
        if self.harmonics > MOST_HARMONICS:
            raise InputError(f"harmonics must lie in 0..{MOST_HARMONICS}, got {self.harmonics}")
        check_number("tolerance", self.tolerance, 0.0, 1.0, open_ends=True)
        if self.length is not None:
            check_number("length", self.length, 0.0, open_ends=True)

    def _learn(self, X: Array, Y: Array) -> None:
        from scipy.optimize import least_squares

        robot, rows = self.robot, Y.shape[1]
        if X.shape[1] != robot.dof:
            raise InputError(f"robot {robot.name!r} has {robot.dof} joints, X {X.shape[1]} columns")
        if rows not in (3, 6):
            raise InputError(f"errors must have 3 columns, or 6 with rotations, got {rows}")
        frames, waves = len(robot.frames), gear_waves(robot, X, int(self.harmonics))
        links, total = 6 * frames, 6 * frames + waves[0].size
        measured = _moved(robot.fk(X), Y)
        weights = np.ones(rows)
        weights[3:] = self.length or axis_lines(robot.frames, robot.kinds).size

        def parts(values: Array) -> tuple[Array, Array]:
            full = np.zeros(total)
            full[found] = values
            return full[:links].reshape(frames, 6), full[links:].reshape(waves.shape[1:])

        def residual(values: Array) -> Array:
            errors, gear = parts(values)
            T = with_link_errors(robot, errors).fk(X + (waves * gear).sum(axis=2))
            return np.asarray((_between(measured, T, rows) * weights).ravel())

        def jacobian(values: Array) -> Array:
            errors, gear = parts(values)
            joints = X + (waves * gear).sum(axis=2)
            by_links = identification_jacobian(robot, joints, errors)
            by_joints = with_link_errors(robot, errors).jacobian(joints)
            by_gear = by_joints[..., None] * waves[:, None]
            both = [J[:, :rows].reshape(len(X), rows, -1) for J in (by_links, by_gear)]
            J = np.concatenate(both, axis=2) * weights[:, None]
            return np.asarray(J.reshape(Y.size, -1)[:, found])

        found = np.arange(total)
        found = independent(jacobian(np.zeros(total)), self.tolerance)
        self._warn_if_few(Y.size, len(found) + 1, "measured numbers")
        fit: Any = least_squares(
            residual, np.zeros(len(found)), jacobian, x_scale="jac", xtol=1e-12, ftol=1e-12
        )
        self.nominal_ = robot
        self.errors_, self.gear_ = parts(fit.x)
        self.identified_ = np.isin(np.arange(links), found).reshape(frames, 6)
        self.standard_errors_ = np.full((frames, 6), np.nan)
        self.standard_errors_[self.identified_] = _standard_errors(fit)[: self.identified_.sum()]

    def _error(self, X: Array) -> Array:
        waves = gear_waves(self.nominal_, X, self.gear_.shape[1] // 2)
        actual = self.robot_.fk(X + (waves * self.gear_).sum(axis=2))
        return tool_error(self.nominal_, X, actual if self.n_outputs_ == 6 else actual[:, :3, 3])


def _moved(T: Array, error: Array) -> Array:
    """Poses (N, 4, 4) with errors (N, 3 or 6)."""
    out = T.copy()
    out[:, :3, 3] += error[:, :3]
    if error.shape[1] == 6:
        out[:, :3, :3] = se3.rotation_exp(error[:, 3:]) @ T[:, :3, :3]
    return out


def _between(measured: Array, T: Array, rows: int) -> Array:
    """Poses T minus measured ones, (N, 3) or with rotations (N, 6)."""
    far = T[:, :3, 3] - measured[:, :3, 3]
    if rows == 3:
        return far
    turned = se3.rotation_log(T[:, :3, :3] @ np.swapaxes(measured[:, :3, :3], 1, 2))
    return np.hstack([far, turned])


def _standard_errors(fit: Any) -> Array:
    equations, parameters = fit.jac.shape
    if equations <= parameters:
        return np.full(parameters, np.nan)
    variance = 2.0 * fit.cost / (equations - parameters)
    inverse = np.linalg.pinv(fit.jac)
    return np.asarray(np.sqrt(variance * (inverse**2).sum(axis=1)))
