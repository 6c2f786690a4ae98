"""The singular postures of an arm in words, from the family of its closed form.

Each condition is a factor of the determinant of the Jacobian, so together they are all of them.
For arms with fewer joints than six they are where branches of the arm's first joints meet.
"""

from dataclasses import dataclass

from kinverse.solvers.closed_form.families import ClosedFormSpec, Family, Regional

__all__ = ["Singularity", "seven_joint_singularity", "singularities"]


@dataclass(frozen=True)
class Singularity:
    """One condition.

    Attributes:
        name: shoulder, elbow or wrist.
        condition: when it holds; axes are counted from 1.
    """

    name: str
    condition: str


def singularities(spec: ClosedFormSpec) -> tuple[Singularity, ...]:
    """The conditions of an arm with a closed form.

    Example:
        >>> [s.name for s in singularities(closed_form_spec(robot))]
        ['shoulder', 'elbow', 'wrist']
    """
    axes = [str(int(joint) + 1) for joint in spec.joint]
    if spec.family is Family.GENERAL_6R:
        return ()
    if spec.family is Family.DECOUPLED:
        return (
            Singularity("slides", "the three slides move in one plane"),
            Singularity("wrist", "the three turning axes are parallel to one plane"),
        )
    if spec.family is Family.SCARA:
        listed = ", ".join(sorted(axes[:2])) + f" and {axes[2]}"
        return (
            Singularity("elbow", f"axes {listed} lie in one plane: the arm is stretched or folded"),
        )
    if spec.family in (Family.THREE_PARALLEL, Family.THREE_PARALLEL_SHORT):
        found = _three_parallel(axes)
    else:
        found = _regional(spec.regional, axes, _centre(spec.family, axes))
    if len(axes) == 6:
        found.append(
            Singularity(
                "wrist", f"axes {axes[3]}, {axes[4]} and {axes[5]} are parallel to one plane"
            )
        )
    return tuple(found)


def seven_joint_singularity() -> Singularity:
    """Of seven-joint arms with a spherical shoulder and wrist: the elbow's condition.

    There the shoulder and wrist centres cannot come nearer or go apart. The others need two
    conditions at once (Kreutz-Delgado, Long & Seraji, Int. J. Robotics Research 11(5), 1992).
    """
    return Singularity("elbow", "axis 4 and the centres of shoulder and wrist lie in one plane")


def _three_parallel(axes: list[str]) -> list[Singularity]:
    """What the three parallel axes do in their plane splits off the determinant."""
    a, b, c, d, e = axes[:5]
    elbow = Singularity("elbow", f"axes {b}, {c} and {d} lie in one plane: stretched or folded")
    if len(axes) == 5:
        return [elbow]
    point = f"the point where axes {e} and {axes[5]} meet"
    plane = f"{point} lies in the plane through axis {a} parallel to axis {b}"
    return [Singularity("shoulder", plane), elbow]


def _centre(family: Family, axes: list[str]) -> str:
    if family is Family.SPHERICAL_WRIST:
        return f"the wrist centre (axes {axes[3]}, {axes[4]}, {axes[5]})"
    return f"the point where axes {axes[3]} and {axes[4]} meet"


def _regional(regional: Regional, axes: list[str], centre: str) -> list[Singularity]:
    """Factors of the determinant of the first three joints: Pieper's cases, by the lines."""
    a, b, c = axes[:3]
    if regional is Regional.PARALLEL_23:
        shoulder = f"{centre} lies in the plane through axis {a} parallel to axis {b}"
        elbow = f"axes {b} and {c} and {centre} lie in one plane: stretched or folded"
    elif regional is Regional.PARALLEL_12:
        shoulder = f"axes {a} and {b} and {centre} lie in one plane"
        elbow = f"{centre} lies in the plane through axis {c} parallel to axis {a}"
    elif regional is Regional.INTERSECTING_12:
        shoulder = f"{centre} lies in the plane of axes {a} and {b}"
        elbow = f"{centre}, axis {c} and the point where axes {a} and {b} meet lie in one plane"
    else:
        shoulder = f"{centre}, axis {a} and the point where axes {b} and {c} meet lie in one plane"
        elbow = f"{centre} lies in the plane of axes {b} and {c}"
    return [Singularity("shoulder", shoulder), Singularity("elbow", elbow)]
