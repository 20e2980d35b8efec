"""The row of each node: the tetrahedra around it, from which forces and averages are summed."""

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel
from tissue.core.simd import WIDTH, filled
from tissue.core.simd_blocks import width_of
from tissue.core.simd_points import lane_of_row
from tissue.elasticity.finite_elements import Solid, corner_row
from tissue.geometry.tetrahedron import tetrahedron_volume
from tissue.mesh.body import Body
from tissue.mesh.star import LARGEST_STAR, Visits, sorted_star

STAR_POOL_MARGIN = LARGEST_STAR + WIDTH
"""Free slots below which `build_stars` requests a larger pool; more than any one row needs."""


def room_for_stars(n_nodes: int, n_tetrahedra: int) -> int:
    """Return the slots that rows of that many nodes and tetrahedra take, twice over."""
    return 2 * (4 * n_tetrahedra + WIDTH * n_nodes) + STAR_POOL_MARGIN


@kernel
def build_stars(
    solid: Solid, body: Body, visits: Visits, nodes: IntArray, n: int, around: IntArray
) -> int:
    """Write the rows of the first `n` of `nodes`; return how many were written.

    If fewer than `n` were, the pool is full: enlarge it and continue from there.

    Args:
        solid: Rows are written; the shapes of the tetrahedra around the nodes are up to date.
        body: The body.
        visits: For searches.
        nodes: The nodes.
        n: How many of them.
        around: Scratch, shape (LARGEST_STAR,).
    """
    for i in range(n):
        if solid.used + STAR_POOL_MARGIN > len(solid.corner):
            return i
        _build_star(solid, body, visits, nodes[i], around)
    return n


@kernel
def _build_star(solid: Solid, body: Body, visits: Visits, node: int, around: IntArray) -> None:
    n = sorted_star(body, visits, node, around)
    if n > solid.room[node]:
        solid.first[node] = solid.used
        solid.room[node] = filled(n)
        solid.used += solid.room[node]
    first = solid.first[node]
    solid.count[node] = n
    for slot in range(first + n, first + filled(n)):
        solid.around[slot] = solid.corner[slot] = 0
    volume = 0.0
    for i in range(n):
        t = around[i]
        k = 0
        while body.tetrahedra[t, k] != node:
            k += 1
        solid.around[first + i] = width_of(solid.shape) + t
        solid.corner[first + i] = corner_row(solid, t, k)
        volume += 0.25 * tetrahedron_volume(body.rest, body.tetrahedra, t)
    solid.node_volume[node] = volume


@kernel
def tetrahedron_of_slot(solid: Solid, slot: int) -> int:
    """Return the tetrahedron of a slot of a row, whether it is averaged there or not."""
    width, row = width_of(solid.shape), solid.corner[slot]
    block = row // (4 * width) - 1
    t: int = width * block + lane_of_row(row % width, width)
    return t


@kernel
def is_averaged(solid: Solid, slot: int) -> bool:
    """Return whether the tetrahedron of a slot of a row is averaged around the node."""
    return solid.around[slot] > 0  # type: ignore[no-any-return]


@kernel
def corner_of_slot(solid: Solid, slot: int) -> int:
    """Return which of the four corners of its tetrahedron a slot of a row is."""
    corner: int = solid.corner[slot] // width_of(solid.shape) % 4
    return corner
