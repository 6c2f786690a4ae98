"""The feedback loop where roll and yaw are no smooth functions of the joints."""

import numpy as np

import kinverse as kv
from kinverse import se3
from kinverse.learning import sample


def arrived(robot, region, **settings):
    solver = kv.Fusion(region=region, n_poses=50, fallback=None, random_state=3, **settings).fit(
        robot
    )
    return solver.solve(sample(robot, 100, random_state=71, region=region).T).ok.mean()


def test_the_loop_arrives_at_a_pitch_of_nearly_a_quarter_turn():
    robot = kv.load("ir361")
    centre = np.radians([57.0, -83.0, -121.0, 29.0, 110.0, -26.0])
    region = (centre, np.radians(10.0))
    pitch = se3.rpy_from_rotation(robot.fk(centre)[:3, :3])[1]
    assert pitch > np.radians(84.0)
    assert arrived(robot, region) >= 0.95
    # what the document tells a network of a rotation
    assert arrived(robot, region, features="xyz+rpy") < 0.5
