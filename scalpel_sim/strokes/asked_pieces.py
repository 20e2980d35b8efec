"""How many pieces a stroke is to leave: what is joined beside the sheet that the edge sweeps."""

import itertools

import numpy as np

from scalpel_sim.strokes.planned_sheet import mesh_edges
from scalpel_sim.strokes.stroke import Stroke
from tissue import BoolArray, FloatArray, Snapshot
from tissue.support import components

_POSES = 200
"""Poses of a stroke between which its sheet is flat: 0.5 mm of an organ each."""

_REACH = 0.1
"""How far the sheet reaches beyond the ends of the edge, in node sizes: an edge that ends as near
to the skin, or glides on a table, cuts through it, for a cut goes through nodes that are near."""

_ASIDE = np.array((0.61, 0.53, 0.59)) * 1e-3
"""By how much the sheet is moved aside, in node sizes, so that no node of a grid is on it."""

_ROUNDING = 1e-9
"""Share by which a segment may miss a triangle and still meet it: it may pass between two."""


def n_large(volumes: FloatArray, node_size: float) -> int:
    """Return how many volumes are no crumbs: at least a cube as long as the size of a node.

    Args:
        volumes: At rest [m3], shape (n,).
        node_size: Mean size of a node [m].
    """
    return int((volumes >= node_size**3).sum())


def asked_pieces(stroke: Stroke, body: Snapshot, node_size: float) -> int | None:
    """Return the number of pieces, crumbs left out, that a stroke is to leave of a body.

    They are what hangs together by the edges of the mesh that the sheet does not cross, if the body
    does not give way. None for a stroke that says nothing of what it is to cut.

    Args:
        stroke: In the tissue frame.
        body: The body as it lies before the stroke, tissue frame.
        node_size: Mean size of a node [m].
    """
    if stroke.asked is None:
        return None
    edges = mesh_edges(body.tetrahedra)
    ends = body.positions[edges]
    low, high = ends.min(axis=1), ends.max(axis=1)
    is_crossed = np.zeros(len(edges), bool)
    for start, end in stroke.asked:
        for quad in _sheet(stroke, start, end, node_size):
            near = (low <= quad.max(axis=0)).all(axis=1) & (high >= quad.min(axis=0)).all(axis=1)
            for corners in (quad[[0, 1, 2]], quad[[2, 1, 3]]):
                is_crossed[near] |= _meet(ends[near], corners)
    n, label = components(len(body.positions), edges[~is_crossed])
    volumes = np.asarray(np.bincount(label, _volumes_of_nodes(body), n), float)
    return n_large(volumes, node_size)


def _sheet(stroke: Stroke, start: float, end: float, node_size: float) -> list[FloatArray]:
    """Return the flat parts of what the edge sweeps forwards: four corners each [m], (4, 3)."""
    parts = []
    poses = [stroke.pose(t) for t in np.linspace(start, end, _POSES)]
    for before, after in itertools.pairwise(poses):
        motion = after.tip + after.heel - before.tip - before.heel
        if float(motion @ (before.forward + after.forward)) <= 0.0:
            continue
        corners = []
        for pose in (before, after):
            along = pose.heel - pose.tip
            along *= _REACH * node_size / float(np.linalg.norm(along))
            corners += [pose.tip - along, pose.heel + along]
        parts.append(np.array(corners) + _ASIDE * node_size)
    return parts


def _meet(segments: FloatArray, corners: FloatArray) -> BoolArray:
    """Return which segments meet a triangle (Moeller and Trumbore 1997, J. Graphics Tools 2:21).

    Args:
        segments: Ends [m], shape (n, 2, 3).
        corners: Of the triangle [m], shape (3, 3).
    """
    ways, offsets = segments[:, 1] - segments[:, 0], segments[:, 0] - corners[0]
    along, across = corners[1] - corners[0], corners[2] - corners[0]
    normal = np.cross(along, across)
    facing = -ways @ normal
    with np.errstate(divide="ignore", invalid="ignore"):
        turned = np.cross(offsets, ways)
        at = offsets @ normal / facing
        u, v = turned @ across / facing, -turned @ along / facing
        inside = (np.minimum(u, v) >= -_ROUNDING) & (u + v <= 1.0 + _ROUNDING)
        return np.asarray((facing != 0.0) & inside & (at >= 0.0) & (at <= 1.0))


def _volumes_of_nodes(body: Snapshot) -> FloatArray:
    """Return a quarter of the volume of the tetrahedra around each node at rest [m3], (n,)."""
    corners = body.rest_positions[body.tetrahedra]
    quarters = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 24.0
    n = len(body.positions)
    return np.asarray(np.bincount(body.tetrahedra.ravel(), np.repeat(quarters, 4), n), float)
