"""The KR16 in MuJoCo along a straight line: errors and loads of drives, controllers, branches."""

import time

import numpy as np
from numpy.typing import NDArray

import kinverse as kv
from kinverse.bench.report import Line
from kinverse.bench.run import Spread

__all__ = ["simulation"]

Array = NDArray[np.float64]

SECTION = "KR16 in MuJoCo, a line of 0.58 m in 2 s, 21 points"
START = (0.2, -1.2, 1.3, 0.3, 0.8, 0.1)
WAY = (0.3, 0.4, -0.3)
SECONDS, POINTS = 2.0, 21
MASS_ERROR, FRICTION = 0.1, 5.0
"""The links weigh ten percent more than is believed; dry friction of each joint [Nm]."""


def simulation(quick: bool) -> list[Line]:
    """Tracking with wrong masses and friction, and torques of two branches and two drives."""
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
            error = Spread.exact(1e3 * run.rms_position_error)
            bound = 0.1 if control == "computed_torque" else None
            lines.append(_line(f"tool's error with {control}, rms mm", error, bound, note))
        told = simulate(robot, SECONDS * s, q, control="prescribed").torques
        note = f"{label}; rms {_joined(told.rms)}; uniformity {_joined(told.uniformity)}"
        peak = Spread.exact(float(told.peak.max()))
        lines.append(_line("largest torque of a joint, Nm", peak, None, note))
        held = simulate(robot, SECONDS * s, q, drive="tool")
        gap = float(np.abs(held.q - held.q_wanted).max())
        note = f"{label}; forces and moments, peaks {_joined(held.constraint_forces.peak)}"
        what = "tool driven: joints measured against inverse kinematics, largest gap, rad"
        lines.append(_line(what, Spread.exact(gap), None, note))
    rest = [
        simulate(robot, [0.0, 0.002], [row, row], control="prescribed").T[0]
        for row in robot.random(5 if quick else 100, 71)
    ]
    wanted = robot.fk(robot.random(5 if quick else 100, 71))
    far = float(np.abs(np.array(rest) - wanted).max())
    what = "simulated tool pose at rest against fk, largest entry, m"
    lines.append(_line(what, Spread.exact(far), 1e-6, f"{len(rest)} random configurations"))
    return lines


def _followed(robot: kv.Robot, T: Array, q_start: Array) -> Array:
    answers = kv.Numerical().fit(robot).follow(T, q_start)
    return np.asarray(answers.q)


def _joined(values: Array) -> str:
    return " ".join(f"{value:.3g}" for value in values)


def _line(what: str, figure: Spread, bound: float | None, note: str) -> Line:
    return Line(SECTION, "kr16", what, figure, bound, False, note)
