"""What document 000 prints, by name."""

from kinverse.studies.data import printed

__all__ = ["METHODS", "STUDY_NAME", "limits_of_rms", "parameter", "percent_error"]

STUDY_NAME = "chiddarwar2010"
METHODS = ("RBF fusion", "MLP fusion", "RBF absolute", "MLP absolute")


def parameter(name: str) -> float:
    """A parameter of ``parameters.csv``."""
    return float(printed(STUDY_NAME, "parameters").where("parameter", name).text("value")[0])


def limits_of_rms(method: str) -> tuple[float, float]:
    """Least and greatest rms error of a joint that is printed of a method [deg]."""
    row = printed(STUDY_NAME, "results").where("method", method)
    return float(row.text("rms_min_deg")[0]), float(row.text("rms_max_deg")[0])


def percent_error(method: str) -> float:
    """The average error of predicted joint angles that is printed of a method [%]."""
    return float(printed(STUDY_NAME, "results").where("method", method).text("percent_error")[0])
