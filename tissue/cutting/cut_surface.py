"""The surface that the blade leaves behind in the current incision, and its two sides.

It is a surface in the body at rest, where cracks are closed, tetrahedra are never inverted and
nothing moves: the anchors of the edge move along material points.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell


class CutSurface(Arrays):
    """The surface of the current incision. Entries are valid where stamped with its number."""

    number: IntCell
    """Number of the incision, from 1."""
    node_stamp: IntArray = sized("nodes")
    """Incision in which each node's entries were written, shape (node capacity,)."""
    offset: FloatArray = sized("nodes", fill=-1.0)
    """Distance of an on-surface node from the true surface [m], -1 for others; (node capacity,)."""
    past_offset: FloatArray = sized("nodes", fill=-1.0)
    """Largest offset that a node had on earlier cut surfaces [m], -1 if none; (node capacity,)."""
    side: IntArray = sized("nodes")
    """Side of the cut surface that a node was found on, +1 or -1, 0 if unknown; (node
    capacity,)."""
    rank: IntArray = sized("nodes")
    """Place of a node in the crack front of the tip, from 1, or of the heel, from -1 down; 0 for
    others; (node capacity,)."""
    nodes: IntArray = sized("nodes")
    """The nodes on the cut surface, in the order in which they came, shape (node capacity,)."""
    n_nodes: IntCell
    """Number of nodes on the cut surface."""
    tetrahedron_stamp: IntArray = sized("tetrahedra")
    """Incision in which each tetrahedron's side was decided, shape (tetrahedron capacity,)."""
    tetrahedron_side: IntArray = sized("tetrahedra")
    """Side of the cut surface that a tetrahedron is on, 0 if undecided; (tetrahedron capacity,)."""
    front: IntArray = sized(2, fill=-1)
    """Last node of the crack front at the tip and at the heel, or -1; shape (2,)."""
    n_front: IntArray = sized(2)
    """Number of nodes in the crack fronts of the tip and of the heel, shape (2,)."""


def new_cut_surface(n_nodes: int, n_tetrahedra: int) -> CutSurface:
    """Return a cut surface with nothing on it."""
    return CutSurface.new({"nodes": n_nodes, "tetrahedra": n_tetrahedra}, number=1)


@kernel
def begin_cut_surface(surface: CutSurface) -> None:
    """Forget the last incision and begin another."""
    surface.number += 1
    surface.n_nodes = 0
    for end in range(2):
        surface.front[end] = -1
        surface.n_front[end] = 0


@kernel
def touch(surface: CutSurface, node: int) -> None:
    """Reset the entries of `node` unless they belong to the current incision."""
    if surface.node_stamp[node] != surface.number:
        surface.node_stamp[node] = surface.number
        surface.past_offset[node] = max(surface.past_offset[node], surface.offset[node])
        surface.offset[node] = -1.0
        surface.side[node] = 0
        surface.rank[node] = 0


@kernel
def rank_of(surface: CutSurface, node: int) -> int:
    """Return the place of `node` in a crack front of this incision, or 0; see `CutSurface.rank`."""
    if surface.node_stamp[node] != surface.number:
        return 0
    rank: int = surface.rank[node]
    return rank


@kernel
def rank_front_node(surface: CutSurface, node: int, end: int) -> None:
    """Give `node`, which is on the cut surface, the next place in the front of an end."""
    if surface.rank[node] == 0:
        surface.n_front[end] += 1
        surface.rank[node] = surface.n_front[end] if end == 0 else -surface.n_front[end]


@kernel
def on_cut_surface(surface: CutSurface, node: int) -> bool:
    """Return whether `node` lies on the cut surface of the current incision."""
    is_on: bool = surface.node_stamp[node] == surface.number and surface.offset[node] >= 0.0
    return is_on


@kernel
def past_offset(surface: CutSurface, node: int) -> float:
    """Return the largest distance of `node` from an earlier surface that it lies on [m], or -1."""
    offset: float = surface.past_offset[node]
    if surface.node_stamp[node] != surface.number:
        offset = max(surface.past_offset[node], surface.offset[node])
    return offset


@kernel
def side_of(surface: CutSurface, node: int) -> int:
    """Return the side that `node` was found on in this incision, or 0."""
    if surface.node_stamp[node] != surface.number:
        return 0
    side: int = surface.side[node]
    return side


@kernel
def note_side(surface: CutSurface, node: int, side: int, again: bool) -> None:
    """Store the side that `node` was found on; with `again` also where one is stored already."""
    touch(surface, node)
    if again or surface.side[node] == 0:
        surface.side[node] = side


@kernel
def decided_side(surface: CutSurface, t: int) -> int:
    """Return the side decided for tetrahedron `t` in this incision, or 0."""
    if surface.tetrahedron_stamp[t] != surface.number:
        return 0
    side: int = surface.tetrahedron_side[t]
    return side


@kernel
def decide_side(surface: CutSurface, t: int, side: int) -> None:
    """Decide that tetrahedron `t` is on that side."""
    surface.tetrahedron_stamp[t] = surface.number
    surface.tetrahedron_side[t] = side


@kernel
def put_on_cut_surface(surface: CutSurface, node: int, offset: float) -> None:
    """Put `node` on the cut surface; `offset` is its distance from the true surface [m]."""
    touch(surface, node)
    surface.offset[node] = offset
    surface.nodes[surface.n_nodes] = node
    surface.n_nodes += 1
