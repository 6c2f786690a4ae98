"""Arms in MuJoCo: errors and loads of drives, controllers and branches, and every arm's servos."""

import time
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench.report import Line
from kinverse.bench.run import Spread
from kinverse.load import names

if TYPE_CHECKING:
    from kinverse.paths.simulate import Simulation

__all__ = ["simulation"]

Array = NDArray[np.float64]

SECTION = "KR16 in MuJoCo, a line of 0.58 m in 2 s, 21 points"
START = (0.2, -1.2, 1.3, 0.3, 0.8, 0.1)
WAY = (0.3, 0.4, -0.3)
SECONDS, POINTS = 2.0, 21
MASS_ERROR, FRICTION = 0.1, 5.0
"""The links weigh ten percent more than is believed; dry friction of each joint [Nm]."""
ARMS = "Every arm of the catalogue in MuJoCo, near the middle of its limits, 1 s"
ACROSS = 0.1
"""Share of the limits that each joint goes through in that second."""
FOLLOWS, SERVO, GAP, HOLDS = 0.1, 1.0, 1e-4, 1e-5
"""Bounds: computed torque [mm], servo [mm of a metre of reach; a spring gives way under the arm's
weight], joints of a driven tool [rad], forces on a held tool [share of the largest torque]."""


def simulation(quick: bool) -> list[Line]:
    """Tracking with wrong masses and friction, torques of two branches and two drives; all arms."""
    from kinverse.paths.simulate import simulate

    robot = kv.load("kr16")
    s = np.linspace(0.0, 1.0, POINTS)
    blend = s**3 * (10.0 - 15.0 * s + 6.0 * s * s)
    T = np.repeat(robot.fk(START)[None], POINTS, axis=0)
    T[:, :3, 3] += blend[:, None] * np.array(WAY)
    known = kv.Analytic().fit(robot)
    first = known.solve(T[0])
    lines = []
    for branch in (0, 2):
        q = _followed(robot, T, first.q[first.branch == branch][0])
        label = known.branch_labels_[branch]
        for control in ("computed_torque", "servo"):
            start = time.process_time()
            run = simulate(
                robot, SECONDS * s, q, control=control, mass_error=MASS_ERROR, friction=FRICTION
            )
            spent = time.process_time() - start
            note = f"{label}; {len(run.t)} steps in {spent:.2g} s of CPU; {run.reason or 'stable'}"
            error = Spread.exact(1e3 * _error(run))
            bound = FOLLOWS if control == "computed_torque" else SERVO * _reach(robot)
            lines.append(_line(f"tool's error with {control}, rms mm", error, bound, note))
        told = simulate(robot, SECONDS * s, q, control="prescribed").torques
        note = f"{label}; rms {_joined(told.rms)}; uniformity {_joined(told.uniformity)}"
        peak = Spread.exact(float(told.peak.max()))
        lines.append(_line("largest torque of a joint, Nm", peak, None, note))
        held = simulate(robot, SECONDS * s, q, drive="tool")
        gap = float(np.abs(held.q - held.q_wanted).max()) if held.ok else np.inf
        note = f"{label}; forces and moments, peaks {_joined(held.constraint_forces.peak)}"
        what = "tool driven: joints measured against inverse kinematics, largest gap, rad"
        lines.append(_line(what, Spread.exact(gap), GAP, note))
    rest = [
        simulate(robot, [0.0, 0.002], [row, row], control="prescribed").T[0]
        for row in robot.random(5 if quick else 100, 71)
    ]
    wanted = robot.fk(robot.random(5 if quick else 100, 71))
    far = float(np.abs(np.array(rest) - wanted).max())
    what = "simulated tool pose at rest against fk, largest entry, m"
    lines.append(_line(what, Spread.exact(far), 1e-6, f"{len(rest)} random configurations"))
    return lines + _every_arm(quick)


def _every_arm(quick: bool) -> list[Line]:
    """Both controllers at rest and in motion, and what holds a tool at rest."""
    from kinverse.paths.simulate import simulate

    arms = [robot for robot in map(kv.load, names()) if len(robot.kinds) == robot.dof]
    arms = arms[::5] if quick else arms
    errors: dict[tuple[str, str], list[float]] = {}
    forces = []
    for robot in arms:
        low, high = robot.limits.T
        t = np.linspace(0.0, 1.0, 11)
        blend = t**3 * (10.0 - 15.0 * t + 6.0 * t * t)
        moving = low + (high - low) * (0.5 + ACROSS * (0.5 - blend[:, None]))
        still = np.repeat(moving[:1], len(t), axis=0)
        for motion, q in (("at rest", still), ("in motion", moving)):
            servo = _error(simulate(robot, t, q, control="servo")) / _reach(robot)
            errors.setdefault(("servo", motion), []).append(1e3 * servo)
            run = simulate(robot, t, q, mass_error=MASS_ERROR)
            errors.setdefault(("computed_torque", motion), []).append(1e3 * _error(run))
        if robot.dof == 6:
            needed = simulate(robot, t, still, control="prescribed").torque[-1]
            run = simulate(robot, t, still, drive="tool")
            given = robot.jacobian(run.q[-1]).T @ run.constraint_force[-1]
            forces.append(float(np.abs(given - needed).max() / np.abs(needed).max()))
    lines = []
    for (control, motion), values in errors.items():
        unit = "mm for each metre of reach" if control == "servo" else "mm"
        bound = SERVO if control == "servo" else FOLLOWS
        spread = np.array(values)
        note = f"{len(arms)} arms, median {np.median(spread):.2g}, least {spread.min():.2g}"
        what = f"tool's error with {control} {motion}, rms, largest of all, {unit}"
        lines.append(Line(ARMS, "catalogue", what, Spread.exact(spread.max()), bound, False, note))
    what = "force on a held tool at rest against inverse dynamics, share of the largest torque"
    worst = Spread.exact(max(forces))
    lines.append(
        Line(ARMS, "catalogue", what, worst, HOLDS, False, f"{len(forces)} arms of six joints")
    )
    return lines


def _error(run: "Simulation") -> float:
    """The rms error of the tool [m], infinite for a run that became unstable."""
    return run.rms_position_error if run.ok else np.inf


def _reach(robot: kv.Robot) -> float:
    return float(sum(np.linalg.norm(frame[:3, 3]) for frame in robot.frames[1:]))


def _followed(robot: kv.Robot, T: Array, q_start: Array) -> Array:
    answers = kv.Numerical().fit(robot).follow(T, q_start)
    return np.asarray(answers.q)


def _joined(values: Array) -> str:
    return " ".join(f"{value:.3g}" for value in values)


def _line(what: str, figure: Spread, bound: float | None, note: str) -> Line:
    return Line(SECTION, "kr16", what, figure, bound, False, note)
