"""Masajedi, Shirazi and Ghanbarzadeh, bees algorithm for a KUKA KR16, 2013."""

from kinverse.studies.masajedi2013 import (
    bees_tables,
    equations,
    error_models,
    motion_tables,
    parameters,
)
from kinverse.studies.study import Study

__all__ = ["STUDY"]

STUDY = Study(
    name="masajedi2013",
    title="Verification of bee algorithm based path planning for a 6DOF manipulator",
    source="P. Masajedi, K. Heidari Shirazi, A. Ghanbarzadeh, Verification of bee algorithm based"
    " path planning for a 6DOF manipulator using ADAMS, article 995, 2013",
    seeds={
        "arms, joint values, held out ones and noise of section 5": "the four streams [seed, 0] to"
        " [seed, 3]"
    },
    tables=(
        *equations.TABLES,
        *parameters.TABLES,
        *bees_tables.TABLES,
        *motion_tables.TABLES,
        *error_models.TABLES,
    ),
)
