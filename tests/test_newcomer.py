"""What a newcomer gets wrong: units, shapes and starts, and what is said about it."""

import numpy as np
import pytest

import kinverse as kv
from kinverse.errors import InputError

RNG = np.random.default_rng(8)


def test_poses_are_built_in_one_call():
    xyz, rpy = RNG.normal(size=(4, 3)), RNG.normal(size=(4, 3))
    quat = RNG.normal(size=(4, 4))
    quat /= np.linalg.norm(quat, axis=1)[:, None]
    direction, angle = RNG.normal(size=(4, 3)), RNG.normal(size=4)
    for name, rows in (
        ("rpy", list(rpy)),
        ("quat", list(quat)),
        ("axis", list(zip(direction, angle, strict=True))),
    ):
        whole = {"rpy": rpy, "quat": quat, "axis": (direction, angle)}[name]
        single = [kv.pose(p, **{name: row}) for p, row in zip(xyz, rows, strict=True)]
        assert np.array_equal(kv.pose(xyz, **{name: whole}), single)
        assert np.array_equal(kv.pose(**{name: whole})[:, :3, 3], np.zeros((4, 3)))
        one = kv.pose(xyz, **{name: rows[0]})
        assert np.array_equal(one[:, :3, :3], [single[0][:3, :3]] * 4)
        assert np.array_equal(one[:, 3], [[0, 0, 0, 1]] * 4)
    assert np.array_equal(kv.pose(xyz)[:, :3, 3], xyz) and kv.pose(xyz[0]).shape == (4, 4)
    assert kv.pose(np.empty((0, 3))).shape == (0, 4, 4)
    assert kv.pose(axis=([0, 0, 1], angle)).shape == (4, 4, 4)
    assert kv.pose(axis=(direction, 0.5)).shape == (4, 4, 4)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        ({"xyz": np.zeros((4, 3)), "rpy": np.zeros((3, 3))}, "xyz has 4 rows and the rotation 3"),
        ({"xyz": np.zeros((2, 2, 3))}, "xyz must have shape"),
        ({"quat": [[1, 0, 0, 0], [2, 0, 0, 0]]}, "length 2 in row 1"),
        ({"axis": (np.ones((2, 3)), np.ones(3))}, "2 directions and 3 angles"),
        ({"axis": ([[0, 0, 1], [0, 0, 0]], 1.0)}, "must not be zero"),
    ],
)
def test_poses_that_do_not_fit_are_refused(given, says):
    with pytest.raises(InputError, match=says):
        kv.pose(**given)


def test_positions_in_place_of_poses_get_a_hint():
    for xyz in ([0.9, 0.3, 1.1], np.ones((5, 3))):
        with pytest.raises(InputError, match=r"for positions: kv\.pose\(xyz\)"):
            kv.solve(kv.load("kr16"), xyz, task="position")


def test_follow_starts_inside_the_limits():
    arm = kv.load("panda")
    q = arm.limits.mean(axis=1)
    bad = q.copy()
    bad[3] = 1.0
    with pytest.raises(InputError, match="q_start: joint 'panda_joint4' is at 1, outside"):
        kv.Numerical().fit(arm).follow(arm.fk(q), bad)
    kv.Numerical(limits="ignore").fit(arm).follow(arm.fk(q), bad)


def test_degrees_in_a_dh_table_are_warned_of():
    rows = {"a": [0.1, 0.1], "d": 0, "joints": "RR"}
    with pytest.warns(UserWarning, match="alpha of robot 'robot' reach 90"):
        kv.Robot.from_dh(**rows, alpha=[90, 0])
    with pytest.warns(UserWarning, match="limits of robot 'robot' reach 185"):
        kv.Robot.from_dh(**rows, alpha=0, limits=[(-185, 185), None])


def test_letters_of_a_dh_table_may_be_a_list():
    def arm(joints):
        return kv.Robot.from_dh(a=0.1, d=0, alpha=0.3, joints=joints)

    assert arm(["R", "F", "R"]) == arm("RFR")
    with pytest.raises(InputError, match="joints must be letters"):
        arm(["R", "revolute"])
