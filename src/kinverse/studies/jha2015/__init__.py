"""P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, NIT Rourkela, 2015."""

from kinverse.studies.jha2015 import conventional, networks, swarm
from kinverse.studies.study import Study

__all__ = ["STUDY"]

STUDY = Study(
    name="jha2015",
    title="Inverse kinematics of robot manipulators by closed form, networks and swarms",
    source="P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, National"
    " Institute of Technology Rourkela, 2015",
    tables=(*networks.TABLES, *swarm.TABLES, *conventional.TABLES),
)
