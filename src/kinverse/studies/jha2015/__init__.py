"""P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, NIT Rourkela, 2015."""

from kinverse.studies.jha2015 import (
    conventional,
    hybrid_networks,
    named_networks,
    network_times,
    planar_networks,
    swarm_tables,
    swarm_times,
)
from kinverse.studies.study import Study

__all__ = ["STUDY"]

STUDY = Study(
    name="jha2015",
    title="Inverse kinematics of robot manipulators by closed form, networks and swarms",
    source="P. Jha, Inverse kinematic analysis of robot manipulators, PhD thesis, National"
    " Institute of Technology Rourkela, 2015",
    tables=(
        *planar_networks.TABLES,
        *named_networks.TABLES,
        *hybrid_networks.TABLES,
        *conventional.TABLES,
        *network_times.TABLES,
        *swarm_tables.TABLES,
        *swarm_times.TABLES,
    ),
)
