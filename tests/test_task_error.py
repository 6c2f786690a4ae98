"""The measure of an error, task by task, against the oracle, up to a half turn."""

import numpy as np
import pytest

import oracle
from kinverse import kernels
from kinverse.robot import Robot
from kinverse.solvers.numerical import Numerical
from kinverse.task import TASKS

ANGLES = [0.0, 1e-9, 1e-4, 1.0, 2.0, 3.0, np.pi - 1e-3, np.pi - 1e-9, np.pi]


@pytest.fixture(params=kernels.instruction_sets())
def instruction_set(request):
    before = kernels.instruction_set()
    kernels.set_instruction_set(request.param)
    yield request.param
    kernels.set_instruction_set(before)


def measured(task, T_reached, T_target):
    """Errors by the native verification of a one-joint arm that stands where it stands."""
    arm = Robot(frames=[np.eye(4), T_reached], kinds="R")
    q = np.zeros((1, 1))
    table = kernels.verify(
        arm.chain, TASKS[task].code, T_target[None], q, np.zeros(1, np.int64),
        np.zeros(1, np.int32), np.full(1, 3, np.uint8), None, 100.0, 100.0, False, False,
    )  # fmt: skip
    return float(table.position_error[0]), float(table.rotation_error[0])


@pytest.mark.parametrize("angle", ANGLES)
@pytest.mark.parametrize("task", TASKS)
def test_errors_match_the_oracle(task, angle, instruction_set):
    rng = np.random.default_rng(3)
    for _ in range(5):
        # rigid to the last digit: the robot's frames are
        R = oracle.nearest_rotation(oracle.about(rng.normal(size=3), rng.uniform(0, 3)))
        reached = oracle.homogeneous(R, rng.normal(size=3))
        axis = rng.normal(size=3)
        target = oracle.homogeneous(oracle.about(axis, angle) @ reached[:3, :3], rng.normal(size=3))
        position, rotation = measured(task, reached, target)
        d = target[:3, 3] - reached[:3, 3]
        expected = np.linalg.norm(d[:2]) if task == "planar" else np.linalg.norm(d)
        assert position == pytest.approx(expected, abs=1e-12)
        turn = {
            "pose": angle,
            "position": 0.0,
            "position_axis": np.arccos(np.clip(target[:3, 2] @ reached[:3, 2], -1, 1)),
        }.get(task, abs(angle * axis[2] / np.linalg.norm(axis)))
        # half a turn away, and in the arc cosine of the expectation, half the digits are lost
        assert rotation == pytest.approx(turn, abs=1e-6)
        if angle <= 1e-4 and task not in ("position", "position_axis"):
            assert rotation == pytest.approx(turn, abs=1e-14)


@pytest.mark.parametrize("task", TASKS)
def test_the_iteration_uses_the_derivative_of_that_error(task):
    """Newton steps on an exact derivative converge quadratically: a few of them are enough."""
    rng = np.random.default_rng(4)
    arm = random_arm(rng, 7)
    q = arm.random(20, rng=1)
    start = q + rng.normal(size=q.shape) * 0.05
    solver = Numerical(task=task, method="newton_raphson", max_iterations=8, limits="ignore").fit(
        arm
    )
    assert solver.solve(arm.fk(q), q_seed=start).ok.mean() >= 0.95


def random_arm(rng, n):
    return Robot.from_dh(
        a=rng.uniform(0.05, 0.4, n),
        d=rng.uniform(-0.3, 0.3, n),
        alpha=rng.uniform(-np.pi, np.pi, n),
        theta=rng.uniform(-np.pi, np.pi, n),
        joints="R" * n,
    )
