"""Pictures of population searches and of joint paths; angles in degrees. Needs the extra "plot"."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from kinverse.errors import MissingExtra
from kinverse.optimizers import History
from kinverse.ranking import turning

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from kinverse.paths import JointPath
    from kinverse.robot import Robot
    from kinverse.solvers.swarm import Swarm

__all__ = [
    "convergence",
    "fitness_surface",
    "joint_histograms",
    "joint_path_figure",
    "search_history",
    "swarm_figure",
]

Array = NDArray[np.float64]

GRID = 121
"""Points along each side of a fitness surface."""
LEAST = 1e-16
"""Costs are drawn on a logarithmic scale from here."""


def swarm_figure(solver: "Swarm", T: ArrayLike, rng: Any = None, title: str = "") -> "Figure":
    """Four pictures of the searches of some poses; the last three are of the first pose.

    Args:
        solver: a fitted ``Swarm``.
        T: (4, 4) or (N, 4, 4) poses.
        rng: as in ``solve``.
        title: over all.

    Raises:
        MissingExtra: Matplotlib is not installed.

    Example:
        >>> swarm_figure(kv.Swarm(optimizer="gwo").fit(robot), T).savefig("gwo.png")
    """
    figure = new_figure((11.0, 8.0))
    first = np.asarray(T, dtype=np.float64).reshape(-1, 4, 4)[0]
    history = solver.watch(first, rng=rng)
    axes = figure.subplots(2, 2).ravel()
    name = type(solver.optimizer_).__name__
    convergence(axes[0], {name: solver.watch(T, rng=rng, population=False)})
    joints = (0, min(1, solver.robot_.dof - 1))
    search_history(axes[1], solver.robot_, history, joints=joints)
    joint_histograms(axes[2], solver.robot_, history)
    best = history.population_values[-1, 0].argmin()
    fitness_surface(axes[3], solver, first, history.population[-1, 0, best], joints=joints)
    figure.suptitle(title or f"{solver.robot_.name}, {name}")
    return figure


def convergence(ax: "Axes", histories: Mapping[str, History]) -> None:
    """Best value against evaluations: the median over the problems, and the band of quartiles."""
    for name, history in histories.items():
        spent = np.median(history.evaluations, axis=1)
        low, middle, high = np.quantile(np.maximum(history.best, LEAST), (0.25, 0.5, 0.75), axis=1)
        (line,) = ax.plot(spent, middle, label=name)
        ax.fill_between(spent, low, high, alpha=0.2, color=line.get_color(), linewidth=0)
    problems = max((history.best.shape[1] for history in histories.values()), default=0)
    ax.set_yscale("log")
    ax.set_xlabel("evaluations")
    ax.set_ylabel("best objective")
    told = f", median and quartiles of {problems} poses" if problems > 1 else " of one pose"
    ax.set_title("convergence" + told)
    ax.legend(frameon=False)


def search_history(
    ax: "Axes", robot: "Robot", history: History, pose: int = 0, joints: tuple[int, int] = (0, 1)
) -> None:
    """Where the population went: two joints of every member, early light and late dark."""
    points = _shown(robot, history.population[:, pose])
    steps, members = points.shape[:2]
    share = np.repeat(np.linspace(0.0, 1.0, steps), members)
    dots = ax.scatter(
        points[..., joints[0]].ravel(),
        points[..., joints[1]].ravel(),
        c=share,
        s=4,
        cmap="viridis_r",
        linewidths=0,
    )
    ax.figure.colorbar(dots, ax=ax, label="share of the search")
    _name_joints(ax, robot, joints)
    ax.set_title("search history")


def joint_histograms(ax: "Axes", robot: "Robot", history: History, pose: int = 0) -> None:
    """How the joints of the last population spread, each over its own range."""
    points = history.population[-1, pose]
    low, high = robot.limits.T
    share = (points - low) / np.maximum(high - low, 1e-12)
    share = np.mod(share, 1.0, where=(share < 0.0) | (share > 1.0), out=share)
    bins = np.linspace(0.0, 1.0, 41)
    for joint, name in enumerate(robot.joint_names):
        ax.hist(share[:, joint], bins=bins.tolist(), histtype="step", label=name)
    ax.set_xlabel("joint, 0 at its lower limit and 1 at its upper")
    ax.set_ylabel("members")
    ax.set_title("joints of the last population")
    ax.legend(frameon=False, fontsize="small", ncols=2)


def fitness_surface(
    ax: "Axes", solver: "Swarm", T: ArrayLike, q: ArrayLike, joints: tuple[int, int] = (0, 1)
) -> None:
    """The objective over two joints, the others held at q (n,), which is marked."""
    robot, box = solver.robot_, solver.box_
    at = np.asarray(q, dtype=np.float64)
    sides = [np.linspace(box[joint, 0], box[joint, 1], GRID) for joint in joints]
    grid = np.broadcast_to(at, (GRID, GRID, robot.dof)).copy()
    if joints[0] != joints[1]:
        grid[..., joints[0]], grid[..., joints[1]] = np.meshgrid(*sides)
    cost = np.log10(np.maximum(solver.cost(T, grid), LEAST))
    shown = _shown(robot, grid)
    filled = ax.contourf(
        shown[..., joints[0]], shown[..., joints[1]], cost, levels=24, cmap="magma"
    )
    ax.figure.colorbar(filled, ax=ax, label="log10 of the objective")
    here = _shown(robot, at)
    ax.plot(here[joints[0]], here[joints[1]], "o", mfc="none", mec="white", ms=9)
    _name_joints(ax, robot, joints)
    ax.set_title("objective about the marked point")


def joint_path_figure(joint_path: "JointPath", title: str = "") -> "Figure":
    """The joints along a path, their limits, and the size of their steps.

    What is not tracked is grey; limits are dashed where they lie among the values that are drawn.

    Args:
        joint_path: from ``kinverse.paths.track``.
        title: over both.

    Raises:
        MissingExtra: Matplotlib is not installed.

    Example:
        >>> joint_path_figure(track(robot, T)).savefig("joints.png")
    """
    robot = joint_path.robot
    figure = new_figure((9.0, 6.0))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=[3, 1])
    shown, turns = _shown(robot, joint_path.q), turning(robot)
    for joint, name in enumerate(robot.joint_names):
        for k, (start, end) in enumerate(joint_path.intervals):
            (line,) = above.plot(
                np.arange(start, end),
                shown[start:end, joint],
                color=f"C{joint % 10}",
                marker="." if end - start == 1 else "",
            )
            if k == 0:
                line.set_label(f"{name} [{'deg' if turns[joint] else 'm'}]")
    _limits_in_view(above, robot)
    _steps(below, joint_path, shown)
    for gap in joint_path.gaps:
        for ax in (above, below):
            ax.axvspan(gap.start - 0.5, gap.end - 0.5, color="0.85", lw=0.8)
    above.set_ylabel(f"joint values [{_units(turns)}]")
    below.set_xlabel("sample")
    below.locator_params("x", integer=True)
    if joint_path.intervals:
        figure.legend(*above.get_legend_handles_labels(), loc="outside right upper", fontsize=9)
    figure.suptitle(title or f"{robot.name}: {int(joint_path.ok.sum())} samples tracked")
    return figure


def _limits_in_view(ax: "Axes", robot: "Robot") -> None:
    """The joints' limits as dashed lines, where they lie among the values that are drawn."""
    bottom, top = ax.get_ylim()
    label = "limits of the joints"
    for joint, ends in enumerate(_shown(robot, robot.limits.T).T):
        for end in ends.tolist():
            if bottom <= end <= top:
                # shifted dashes: limits that are alike are seen side by side
                dashes = (4.0 * joint, (4.0, 4.0))
                ax.axhline(end, color=f"C{joint % 10}", ls=dashes, lw=0.8, label=label)
                label = "_"
    ax.set_ylim(bottom, top)


def _steps(ax: "Axes", joint_path: "JointPath", shown: Array) -> None:
    """The largest step to each sample, of turning joints and of slides each on their own scale."""
    turns = turning(joint_path.robot)
    kinds = [kind for kind in ((turns, "deg"), (~turns, "m")) if kind[0].any()]
    for k, (some, unit) in enumerate(kinds):
        axes, color = (ax, "black") if k == 0 else (ax.twinx(), "tab:purple")
        most = 0.0
        for start, end in joint_path.intervals:
            steps = np.abs(np.diff(shown[start:end, some], axis=0)).max(axis=1)
            axes.plot(np.arange(start + 1, end), steps, color=color, lw=0.8)
            most = max(most, steps.max(initial=0.0))
        axes.set_ylim(0.0, 1.1 * most or 1.0)
        axes.set_ylabel(f"largest step [{unit}]", color=color)


def _units(turns: NDArray[np.bool_]) -> str:
    return " or ".join(unit for unit, some in (("deg", turns), ("m", ~turns)) if some.any())


def new_figure(size: Sequence[float]) -> "Figure":
    """An empty figure that belongs to no window.

    Raises:
        MissingExtra: Matplotlib is not installed.
    """
    try:
        from matplotlib.figure import Figure
    except ModuleNotFoundError as error:
        raise MissingExtra("a picture", "plot") from error
    return Figure(figsize=(size[0], size[1]), layout="constrained")


def _shown(robot: "Robot", q: Array) -> Array:
    """Joint values (..., n) in degrees where they turn, metres where they slide."""
    return np.where(turning(robot), np.degrees(q), q)


def _name_joints(ax: "Axes", robot: "Robot", joints: tuple[int, int]) -> None:
    units = np.where(turning(robot), "deg", "m")
    ax.set_xlabel(f"{robot.joint_names[joints[0]]} [{units[joints[0]]}]")
    ax.set_ylabel(f"{robot.joint_names[joints[1]]} [{units[joints[1]]}]")
