"""Document 000: networks of increments and a loop by forward kinematics around them."""

from kinverse.studies.chiddarwar2010.data_set import DATA_SET
from kinverse.studies.chiddarwar2010.fusion import FUSION, POSES_OF_A_PATH, TABLE_2
from kinverse.studies.chiddarwar2010.held_out import POSES, SAMPLES, SPLIT, START
from kinverse.studies.chiddarwar2010.loop import FRESH
from kinverse.studies.chiddarwar2010.path import PATH
from kinverse.studies.chiddarwar2010.poses import CENTRES
from kinverse.studies.chiddarwar2010.rms import FIGURE_9, SPLITS_TABLE, TABLE_3
from kinverse.studies.chiddarwar2010.source import STUDY_NAME
from kinverse.studies.chiddarwar2010.times import TABLE_4
from kinverse.studies.study import Study

__all__ = ["STUDY"]

STUDY = Study(
    name=STUDY_NAME,
    title="RBF and MLP networks of increments, and the fusion process",
    source=(
        "S. S. Chiddarwar and N. R. Babu, Comparison of RBF and MLP neural networks to solve"
        " inverse kinematic problem for 6R serial robot by a fusion approach, 2010 (document 000)"
    ),
    seeds={
        "centres of regions": f"{CENTRES} + seed",
        "poses": f"{POSES} + seed",
        "splits": f"{SPLIT} + seed",
        "samples of absolute networks": f"{SAMPLES} + seed",
        "first weights": f"{START} + seed",
        "fresh poses": f"{FRESH} + seed",
        "paths": f"{PATH} + seed",
    },
    tables=(DATA_SET, FUSION, TABLE_2, POSES_OF_A_PATH, TABLE_3, FIGURE_9, SPLITS_TABLE, TABLE_4),
)
