"""How far cut faces lie from the blade's path, and what state the tetrahedra are in."""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import BoolArray
from tissue.core.jit import kernel
from tissue.core.vec3 import vec3
from tissue.geometry.tetrahedron import smallest_altitude, tetrahedron_volume
from tissue.mesh.body import CUT, Body


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
