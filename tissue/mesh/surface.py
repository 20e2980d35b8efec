"""The boundary triangles of a body, and what cuts did to it: path error, altitudes, inversion."""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import vec3
from tissue.geometry.tetrahedron import smallest_altitude, tetrahedron_volume
from tissue.mesh.body import CUT, Body, is_open
from tissue.mesh.faces import OUTWARD
from tissue.mesh.nonconforming import HANGING
from tissue.types import Surface


@kernel
def boundary_triangles(
    body: Body, triangles: IntArray, is_cut: BoolArray, outward: IntArray
) -> int:
    """Write the triangles without a neighbour; return how many.

    `triangles`, shape (room, 3), and `is_cut`, shape (room,), have room for four a tetrahedron;
    `outward` is OUTWARD.
    """
    n = 0
    for t in range(body.n_tetrahedra):
        for f in range(4):
            if is_open(body.links[t, f]):
                for k in range(3):
                    triangles[n, k] = body.tetrahedra[t, outward[f, k]]
                is_cut[n] = body.links[t, f] == CUT
                n += 1
    return n


def boundary_surface(body: Body) -> Surface:
    """Return the boundary with its own vertices: only nodes that some triangle uses."""
    triangles, is_cut = _boundary(body)
    used = _used_by(triangles, body)
    nodes = np.flatnonzero(used)
    vertex = np.cumsum(used) - 1
    labels = _labels_of_boundary(body)
    return Surface(body.positions[nodes], body.rest[nodes], vertex[triangles], is_cut, labels)


def _labels_of_boundary(body: Body) -> IntArray | None:
    """Return the label of each triangle of `boundary_triangles`; None of a body with one label."""
    label = body.materials.label
    if (label == label[0]).all():
        return None
    links = body.links[: body.n_tetrahedra]
    tetrahedra = np.nonzero((links > HANGING) & (links < 0))[0]
    return np.asarray(label[body.material[tetrahedra]])


def boundary_nodes(body: Body) -> IntArray:
    """Return the nodes of the vertices of `boundary_surface`, in order, shape (n_vertices,)."""
    return np.flatnonzero(_used_by(_boundary(body)[0], body))


def _boundary(body: Body) -> tuple[IntArray, BoolArray]:
    """Return the nodes of the boundary triangles, and whether they are faces of a cut."""
    room = 4 * body.n_tetrahedra
    triangles = np.empty((room, 3), dtype=np.int64)
    is_cut = np.empty(room, dtype=np.bool_)
    n = boundary_triangles(body, triangles, is_cut, OUTWARD)
    return triangles[:n], is_cut[:n].copy()


def _used_by(triangles: IntArray, body: Body) -> BoolArray:
    """Return whether each node is one of the triangles, shape (n_nodes,)."""
    used = np.zeros(body.n_nodes, dtype=np.bool_)
    used[triangles] = True
    return used


class PathError(NamedTuple):
    """Distance of the nodes on cut faces from where the blade passed."""

    n_nodes: int
    """Number of nodes on cut faces."""
    mean: float
    """Mean distance [m], 0 where there is no cut."""
    largest: float
    """Largest distance [m]."""


def path_error(body: Body) -> PathError:
    """Return the path error of all cuts in the body, in O(tetrahedra)."""
    return PathError(*_path_error(body, np.zeros(body.n_nodes, dtype=np.bool_)))


@kernel
def _path_error(body: Body, seen: BoolArray) -> tuple[int, float, float]:
    """Number of nodes on cut faces, mean and largest of `Body.off_path` [m]."""
    n = 0
    total = 0.0
    largest = 0.0
    for t in range(body.n_tetrahedra):
        for f in range(4):
            if body.links[t, f] != CUT:
                continue
            for k in range(4):
                node = body.tetrahedra[t, k]
                if k == f or seen[node] or body.off_path[node] < 0.0:
                    continue
                seen[node] = True
                n += 1
                total += body.off_path[node]
                largest = max(largest, body.off_path[node])
    return n, total / max(n, 1), largest


@kernel
def lowest_altitude(body: Body) -> float:
    """Return the smallest altitude of all tetrahedra at rest [m]."""
    lowest = np.inf
    for t in range(body.n_tetrahedra):
        lowest = min(
            lowest,
            smallest_altitude(
                vec3(body.rest, body.tetrahedra[t, 0]),
                vec3(body.rest, body.tetrahedra[t, 1]),
                vec3(body.rest, body.tetrahedra[t, 2]),
                vec3(body.rest, body.tetrahedra[t, 3]),
            ),
        )
    return lowest


@kernel
def inverted_share(body: Body) -> float:
    """Return how many tetrahedra are inside out, as a share of all."""
    n = 0
    for t in range(body.n_tetrahedra):
        n += tetrahedron_volume(body.positions, body.tetrahedra, t) <= 0.0
    return n / body.n_tetrahedra
