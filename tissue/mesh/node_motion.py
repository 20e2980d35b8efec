"""Nodes that have moved since a search, and whether the motion of a body is finite."""

import math

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, lanes
from tissue.core.simd_blocks import sum_of_lanes
from tissue.core.simd_rows import rows_of_three
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import vec3
from tissue.mesh.body import Body


class Moved(Arrays):
    """The nodes that have moved, each once."""

    nodes: IntArray = sized("nodes")
    """Nodes listed, shape (capacity,)."""
    seen: IntArray = sized("nodes")
    """Value of `epoch` when each node was last listed, shape (capacity,)."""
    n_nodes: IntCell
    """Number of nodes listed."""
    epoch: IntCell
    """Number of the list: emptying it begins another."""


def none_moved(n_nodes: int) -> Moved:
    """Return an empty list with room for that many nodes."""
    return Moved.new({"nodes": n_nodes}, epoch=1)


def grown_moved(moved: Moved, n_nodes: int) -> Moved:
    """Return the list with room for that many nodes."""
    return moved.grown({"nodes": n_nodes})


@kernel
def note_moved(moved: Moved, nodes: IntArray, n: int) -> None:
    """Add the first `n` of `nodes` to the list."""
    for i in range(n):
        if moved.seen[nodes[i]] != moved.epoch:
            moved.seen[nodes[i]] = moved.epoch
            moved.nodes[moved.n_nodes] = nodes[i]
            moved.n_nodes += 1


@kernel
def forget_moved(moved: Moved) -> None:
    """Empty the list."""
    moved.n_nodes = 0
    moved.epoch += 1


@kernel
def is_motion_finite(body: Body) -> bool:
    """Return whether all positions and velocities are finite numbers."""
    n = body.n_nodes
    return _are_finite(body.positions, n) and _are_finite(body.velocities, n)


@kernel
def _are_finite(points: FloatArray, n: int) -> bool:
    """Return whether the first `n` points are finite, of an array of shape (capacity, 3)."""
    # The difference of a number from itself is 0 where it is finite, else nan, as is the sum then.
    sums = lanes(0.0)
    n_in_lanes = n // WIDTH * WIDTH
    for i in range(0, n_in_lanes, WIDTH):
        x, y, z = rows_of_three(points, i)
        sums = sums + ((x - x) + (y - y) + (z - z))
    rest = 0.0
    for i in range(n_in_lanes, n):
        p = vec3(points, i)
        rest += (p.x - p.x) + (p.y - p.y) + (p.z - p.z)
    return math.isfinite(sum_of_lanes(sums) + rest)
