"""Robots that several test files share."""

import os

# two pools of linear algebra threads on two cores: small matrices take many times as long
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import hypothesis  # noqa: E402
import numpy as np  # noqa: E402
import pytest  # noqa: E402

from kinverse.robot import Robot  # noqa: E402

# the same examples in every run: a red run is a change's doing, and anyone can repeat it
hypothesis.settings.register_profile("repeatable", derandomize=True)
hypothesis.settings.load_profile("repeatable")


@pytest.fixture(scope="session")
def planar():
    """Three parallel joints, 100/70/50 mm; its redundancy for "position" is one."""
    return Robot.from_dh(a=[0.1, 0.07, 0.05], d=0, alpha=0, joints="RRR", name="planar3r")


@pytest.fixture(scope="session")
def puma():
    """A 6R arm with a spherical wrist (PUMA 560, Craig's table 3.3, modified DH)."""
    half = np.pi / 2
    return Robot.from_dh(
        a=[0, 0, 0.4318, 0.0203, 0, 0],
        d=[0, 0, 0.15, 0.4318, 0, 0],
        alpha=[0, -half, 0, -half, half, -half],
        convention="modified",
        limits=np.deg2rad(
            [[-160, 160], [-245, 45], [-45, 225], [-110, 170], [-100, 100], [-266, 266]]
        ),
        name="puma560",
    )


@pytest.fixture(scope="session")
def seven():
    """A 7R arm with offset-free shoulder, elbow and wrist (the iiwa's lengths)."""
    half = np.pi / 2
    return Robot.from_dh(
        a=0,
        d=[0.36, 0, 0.42, 0, 0.4, 0, 0.126],
        alpha=[-half, half, half, -half, -half, half, 0],
        joints="RRRRRRR",
        name="seven",
    )
