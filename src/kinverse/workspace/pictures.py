"""Pictures of planar workspaces, as figure 4 of document 003. Needs the extra "plot"."""

from typing import TYPE_CHECKING

import numpy as np

from kinverse.plots import new_figure
from kinverse.workspace.planar import PlanarWorkspace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["draw_workspace", "workspace_figure"]

GRID = 61
"""Points along each side of the grid on which service is looked at."""
POSTURES = 1500
"""Random postures drawn: enough to show where they crowd, few enough to leave the coloring seen."""


def workspace_figure(
    space: PlanarWorkspace, points: int = POSTURES, orientations: int = 72, title: str = ""
) -> "Figure":
    """Where the tool gets and, colored, with what share of its directions.

    Args:
        space: the workspace.
        points: random postures drawn as dots; 0: none.
        orientations: directions tried at each point of a grid; 0: leaves the coloring out.
        title: default the arm's name.

    Raises:
        MissingExtra: Matplotlib is not installed.

    Example:
        >>> workspace_figure(PlanarWorkspace(kv.load("planar3r_003"))).savefig("figure4.png")
    """
    figure = new_figure((7.0, 6.0))
    draw_workspace(figure.subplots(), space, points, orientations)
    figure.suptitle(title or f"{space.robot.name}: what the tool reaches")
    return figure


def draw_workspace(
    ax: "Axes", space: PlanarWorkspace, points: int = POSTURES, orientations: int = 72
) -> None:
    """The same in given axes."""
    far = space.annulus[1]
    x, y = space.center
    if orientations:
        side = np.linspace(-far, far, GRID)
        grid = np.stack(np.meshgrid(x + side, y + side), axis=-1)
        share = np.full((GRID, GRID), np.nan)
        reached = space.reaches(grid.reshape(-1, 2)).reshape(GRID, GRID)
        share[reached] = space.service(grid[reached], orientations)
        shown = ax.pcolormesh(
            grid[..., 0], grid[..., 1], share, vmin=0.0, vmax=1.0, cmap="YlGnBu", shading="nearest"
        )
        ax.figure.colorbar(shown, ax=ax, label="share of directions (1: dextrous)")
    if points:
        dots = space.points(points)
        ax.plot(
            *dots.T,
            ".",
            color="0.2",
            alpha=0.35,
            ms=2.0,
            mew=0.0,
            label=f"{points} random postures",
        )
    for k, arc in enumerate(space.boundary):
        line = arc.points(200)
        ax.plot(line[:, 0], line[:, 1], color="tab:red", label="edge" if k == 0 else None)
    if space.turns_fully:
        turn = np.linspace(0.0, 2.0 * np.pi, 200)
        for k, r in enumerate(np.unique(space.dextrous_radii[space.dextrous_radii > 0.0])):
            label = "edge of the dextrous set" if k == 0 else None
            ax.plot(x + r * np.cos(turn), y + r * np.sin(turn), "k--", lw=1, label=label)
    ax.plot(x, y, "k^", label="first joint")
    ax.set_aspect("equal")
    ax.set_xlabel("x [m]")
    ax.set_ylabel("y [m]")
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, -0.12), ncols=2, fontsize="small")
