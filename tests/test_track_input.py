"""What track refuses, and how it says so."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.bench import cases
from kinverse.errors import InputError
from kinverse.paths import Samples, track


@pytest.fixture(scope="module")
def kr16():
    robot = kv.load("kr16")
    return robot, robot.fk(cases.path(robot, 6))


BAD = [
    ({"metric": "mean"}, "metrics are max, l2, time"),
    ({"metric": "time"}, "max_velocity"),
    ({"max_velocity": 1.0}, "max_velocity"),
    ({"metric": "time", "max_velocity": 0.0}, "max_velocity must be positive"),
    ({"max_step": 0.0}, "max_step must be positive"),
    ({"max_step": [0.1, 0.2]}, "max_step"),
    ({"max_step": np.nan}, "max_step"),
    ({"max_step": 3.5}, "joint1"),
    ({"q_start": np.zeros(5)}, "q_start"),
    ({"q_start": np.zeros((2, 6))}, "q_start"),
    ({"q_start": [9.0, 0, 0, 0, 0, 0]}, "outside its limits"),
    ({"keep": 3}, "keep"),
    ({"keep": lambda q: q}, "keep must return"),
    ({"keep": lambda q: np.ones(3, bool)}, "keep must return"),
    ({"tolerance": 1e-3}, "sample"),
    ({"tolerance": 0.0}, "tolerance must be positive"),
    ({"tolerance": True}, "tolerance must be a number"),
    ({"solver": "magic"}, "unknown solver"),
    ({"solver": kv.Analytic}, "solver"),
    ({"task": "fly"}, "unknown task"),
]


@pytest.mark.parametrize("change, said", BAD)
def test_bad_arguments_are_named(kr16, change, said):
    with pytest.raises(InputError, match=said):
        track(*kr16, **change)


def test_bad_paths_are_named(kr16):
    robot, T = kr16
    with pytest.raises(InputError, match="two poses"):
        track(robot, T[0])
    with pytest.raises(InputError, match="two poses"):
        track(robot, T[:0])
    broken = T.copy()
    broken[3:5, 0, 3] = np.nan
    with pytest.raises(InputError, match=r"path\[3\] \(row 3\).*NaN"):
        track(robot, broken)
    with pytest.raises(InputError, match="rigid|rotation|orthonormal"):
        track(robot, 2.0 * T)
    with pytest.raises(InputError, match="Robot"):
        track("kr16", T)


def test_bad_path_objects_are_named(kr16):
    robot, T = kr16

    class Given:
        def __init__(self, sample, call):
            self.given, self.call = sample, call

        def sample(self, count):
            return self.given

        def __call__(self, s):
            return self.call(s)

    with pytest.raises(InputError, match="increase"):
        track(robot, Samples(T, np.zeros(6)))
    with pytest.raises(InputError, match="s must be"):
        track(robot, Samples(T, np.arange(5.0)))
    with pytest.raises(InputError, match="differs from its samples"):
        track(robot, Given(T, lambda s: np.tile(T[0], (len(s), 1, 1))))
    with pytest.raises(InputError, match="must return"):
        track(robot, Given(T, lambda s: T[0]))


def test_limits_without_end_are_refused():
    robot = kv.load("kr16").with_limits(np.tile([-100.0, 100.0], (6, 1)))
    with pytest.raises(InputError, match="windings"):
        track(robot, robot.fk(np.zeros((3, 6))))


def test_answers_are_read_only_and_tell_themselves(kr16):
    robot, T = kr16
    found = track(robot, T)
    with pytest.raises(ValueError):
        found.q[0] = 0.0
    assert "6 of 6 samples" in repr(found) and len(found) == 6
    moved = T.copy()
    moved[2, 0, 3] += 9.0
    assert "OUT_OF_REACH" in repr(track(robot, moved))
    assert T.flags.writeable
