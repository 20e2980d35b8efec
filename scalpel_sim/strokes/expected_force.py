"""Force that a stroke will need: toughness times the width of cut that is open at once."""

import itertools
from typing import NamedTuple

import numpy as np

from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray, TetrahedralMesh, boundary_faces

_POSES = 41
"""Poses of a stroke that are looked at."""

_ROUNDING = 1e-9
"""Weight by which a line may miss a face and still meet it: it may pass between two faces."""

_DIGITS = 12
"""Digits to which two places on an edge, as shares of its length, are one."""


class ExpectedForce(NamedTuple):
    """Force that a blade meets where the cut is widest, if the body does not give way."""

    force: float
    """Force along the motion [N]."""
    width: float
    """Length of edge in the body, seen along the motion [m]."""


def expected_force(stroke: Stroke, mesh: TetrahedralMesh, toughness: float) -> ExpectedForce:
    """Return the largest force that a stroke will take.

    All work goes into area: the force along the motion is toughness times the area that is opened
    per distance (Atkins, Xu and Jeronimidis 2004, J. Mater. Sci. 39:2761).

    Args:
        stroke: In the tissue frame.
        mesh: The body as it lies before the stroke, tissue frame [m].
        toughness: Fracture toughness [J/m2].
    """
    corners = mesh.positions[boundary_faces(mesh.tetrahedra)]
    poses = stroke.poses(_POSES)
    widest = 0.0
    for before, pose in itertools.pairwise(poses):
        motion = 0.5 * (pose.tip + pose.heel - before.tip - before.heel)
        distance = float(np.linalg.norm(motion))
        if distance > 0.0:
            ahead = max(float(motion @ pose.forward) / distance, 0.0)
            widest = max(widest, ahead * length_inside(pose, mesh, corners))
    return ExpectedForce(toughness * widest, widest)


def length_inside(pose: BladeSegment, mesh: TetrahedralMesh, corners: FloatArray) -> float:
    """Return the length of an edge that is in the body [m].

    Args:
        pose: The edge.
        mesh: The body [m].
        corners: Corners of its boundary faces, counter-clockwise seen from outside [m], shape
            (n, 3, 3).
    """
    origin, edge = pose.heel, pose.tip - pose.heel
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    # Moeller and Trumbore 1997, J. Graphics Tools 2:21; `facing` is negative where the edge enters.
    normals = np.cross(along, across)
    facing = normals @ edge
    with np.errstate(divide="ignore", invalid="ignore"):
        offset = origin - corners[:, 0]
        turned = np.cross(edge, offset)
        u = np.einsum("ij,ij->i", turned, across) / facing
        v = -np.einsum("ij,ij->i", turned, along) / facing
        at = -np.einsum("ij,ij->i", normals, offset) / facing
        is_hit = (np.minimum(u, v) >= -_ROUNDING) & (u + v <= 1.0 + _ROUNDING)
        is_hit &= (at >= 0.0) & (at <= 1.0)
    is_hit &= facing != 0.0
    # Where the edge meets one of the mesh, both of its faces are hit there: counted once.
    places = np.round(at, _DIGITS)
    entries, exits = (np.unique(places[is_hit & (s * facing > 0.0)]) for s in (-1.0, 1.0))
    share = float(exits.sum() - entries.sum())
    if len(entries) + len(exits) == 0:
        share = float(is_inside(pose.tip, mesh))
    elif entries.max(initial=-1.0) > exits.max(initial=-1.0):
        share += 1.0  # it entered last: the tip is inside
    return min(max(share, 0.0), 1.0) * float(np.linalg.norm(edge))


def is_inside(point: FloatArray, mesh: TetrahedralMesh) -> bool:
    """Return whether some tetrahedron of the body holds a point."""
    corners = mesh.positions[mesh.tetrahedra]
    near = (corners.min(axis=1) <= point).all(axis=1) & (corners.max(axis=1) >= point).all(axis=1)
    origins, others = corners[near, 0], corners[near, 1:]
    axes = np.swapaxes(others - origins[:, None], 1, 2)
    weights = np.linalg.solve(axes, (point - origins)[:, :, None])[:, :, 0]
    return bool(((weights >= 0.0).all(axis=1) & (weights.sum(axis=1) <= 1.0)).any())
