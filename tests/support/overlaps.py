"""Bodies that touch: how deep they lie in each other, and how fast they move."""

import numpy as np

from tests.support import strokes
from tissue import FloatArray, IntArray, Snapshot, TetrahedralMesh, Tissue
from tissue.mesh.faces import OUTWARD
from tissue.mesh.pieces import piece_of_tetrahedra

ELEMENT = 0.01
"""Edge of a cell in the bodies of these tests [m]."""

SLAB = (0.06, 0.06, 0.02)
"""Size of a block that another lies on [m]."""

NO_GRAVITY = (0.0, 0.0, 0.0)


def joined(first: TetrahedralMesh, second: TetrahedralMesh, offset) -> TetrahedralMesh:
    """Return two bodies as one mesh, the second moved by an offset [m]."""
    return TetrahedralMesh(
        np.vstack([first.positions, second.positions + np.asarray(offset)]),
        np.vstack([first.tetrahedra, second.tetrahedra + len(first.positions)]),
    )


def overlap_depths(body: Snapshot, part: IntArray) -> FloatArray:
    """Return how deep each node that is in another part lies in it [m], testing every pair.

    The depth of a node in a tetrahedron of another part is its distance from the surface of that
    part, approximated by the nearest plane of a boundary face. `part` is that of each tetrahedron.
    """
    of_node = np.zeros(len(body.positions), dtype=np.int64)
    of_node[body.tetrahedra] = part[:, None]
    corners = body.positions[body.tetrahedra]
    to_weights = np.linalg.inv(np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2))
    nodes = body.tetrahedra[:, OUTWARD].reshape(-1, 3)
    faces = np.column_stack([np.repeat(part, 4), np.sort(nodes, axis=1)])
    _, same, count = np.unique(faces, axis=0, return_inverse=True, return_counts=True)
    boundary = nodes[count[same.ravel()] == 1]
    a, b, c = (body.positions[boundary[:, k]] for k in range(3))
    normals = np.cross(b - a, c - a)
    normals /= np.linalg.norm(normals, axis=1)[:, None]
    depths = []
    for node, p in enumerate(body.positions):
        w = np.einsum("tij,tj->ti", to_weights, p - corners[:, 0])
        inside = (w.min(axis=1) > 0.0) & (w.sum(axis=1) < 1.0) & (part != of_node[node])
        if inside.any():
            other = of_node[boundary[:, 0]] == part[inside][0]
            below = -((p - a[other]) * normals[other]).sum(axis=1)
            depths.append(below[below > 0.0].min())
    return np.array(depths)


def overlap_depth(body: Snapshot) -> float:
    """Return the deepest penetration of a node of one piece into another [m]."""
    return float(overlap_depths(body, piece_of_tetrahedra(body)).max(initial=0.0))


def speed(tissue: Tissue) -> float:
    return float(np.linalg.norm(tissue.snapshot().velocities, axis=1).max())


def frame_speed(tissue: Tissue) -> float:
    """Return the largest displacement of a node in a frame over its length [m/s].

    A pinched node may have a velocity without moving.
    """
    before = tissue.snapshot().positions
    tissue.step(None, strokes.DT)
    moved = tissue.snapshot().positions - before
    return float(np.linalg.norm(moved, axis=1).max()) / strokes.DT
