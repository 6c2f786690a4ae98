"""Document 003: a network and a virtual vector for a planar arm with a joint to spare."""

from kinverse.studies.habibkhah2021.arm import STUDY_NAME
from kinverse.studies.habibkhah2021.conditions import CONDITIONS
from kinverse.studies.habibkhah2021.links import LINKS
from kinverse.studies.habibkhah2021.network import FIRST_DATA, FIRST_NETWORK
from kinverse.studies.habibkhah2021.tracking import TRACKING
from kinverse.studies.habibkhah2021.training import TRAINING
from kinverse.studies.habibkhah2021.virtual import VIRTUAL
from kinverse.studies.habibkhah2021.workspace import SEED, WORKSPACE
from kinverse.studies.study import Study

__all__ = ["STUDY"]

STUDY = Study(
    name=STUDY_NAME,
    title="A network with a virtual vector for a planar arm of three joints",
    source=(
        "S. Habibkhah and R. V. Mayorga, An ANN and Virtual Vector Function Approach for the"
        " Computation of the Inverse Kinematics of Redundant Manipulators, 2021 (document 003)"
    ),
    seeds={
        "postures in the workspace": f"{SEED}",
        "samples and their split": f"{FIRST_DATA} + seed",
        "first weights": f"{FIRST_NETWORK} + seed",
    },
    tables=(WORKSPACE, CONDITIONS, TRAINING, VIRTUAL, TRACKING, LINKS),
)
