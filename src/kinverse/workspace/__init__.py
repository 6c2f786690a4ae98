"""Workspaces: what an arm reaches.

>>> import kinverse as kv
>>> from kinverse.workspace import PlanarWorkspace
>>> PlanarWorkspace(kv.load("planar3r_003")).area
"""

from kinverse.workspace.boundary import BoundaryArc
from kinverse.workspace.pictures import draw_workspace, workspace_figure
from kinverse.workspace.planar import PlanarWorkspace

__all__ = ["BoundaryArc", "PlanarWorkspace", "draw_workspace", "workspace_figure"]
