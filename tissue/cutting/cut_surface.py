"""The sheet: the surface that the current incision leaves behind, and the sides that it has.

It is a surface in the body at rest, where cracks are closed, tetrahedra are never inverted and
nothing moves: the path of the anchors is a path of material points (see anchors).
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.mesh.body import grown


class Sheet(Arrays):
    """What is known of the current incision. Entries count only where stamped with its number."""

    number: IntArray
    """Of the incision, shape (1,)."""
    node_stamp: IntArray
    """Shape (node capacity,)."""
    offset: FloatArray
    """Distance of an on-sheet node from the true sheet [m], -1 for others; (node capacity,)."""
    past_offset: FloatArray
    """The largest offset that a node had on earlier sheets [m], -1 if none; (node capacity,)."""
    side: IntArray
    """Side of the sheet that a node was seen on, +1 or -1, 0 if not seen; (node capacity,)."""
    nodes: IntArray
    """The nodes on the sheet, in the order in which they came, shape (node capacity,)."""
    n_nodes: IntArray
    """How many they are, shape (1,)."""
    tetrahedron_stamp: IntArray
    """Shape (tetrahedron capacity,)."""
    tetrahedron_side: IntArray
    """Side that a tetrahedron was decided to be on, 0 if not decided; (tetrahedron capacity,)."""
    front: IntArray
    """Last node of the crack front at the tip and at the heel, or -1; shape (2,)."""


def new_sheet(n_nodes: int, n_tetrahedra: int) -> Sheet:
    """Return a sheet with nothing on it."""
    return Sheet(
        number=np.ones(1, np.int64),
        node_stamp=np.zeros(n_nodes, np.int64),
        offset=np.full(n_nodes, -1.0),
        past_offset=np.full(n_nodes, -1.0),
        side=np.zeros(n_nodes, np.int64),
        nodes=np.zeros(n_nodes, np.int64),
        n_nodes=np.zeros(1, np.int64),
        tetrahedron_stamp=np.zeros(n_tetrahedra, np.int64),
        tetrahedron_side=np.zeros(n_tetrahedra, np.int64),
        front=np.full(2, -1, np.int64),
    )


def grown_sheet(sheet: Sheet, n_nodes: int, n_tetrahedra: int) -> Sheet:
    """Return the sheet with room for that many nodes and tetrahedra."""
    return sheet.replaced(
        node_stamp=grown(sheet.node_stamp, n_nodes),
        offset=grown(sheet.offset, n_nodes, -1.0),
        past_offset=grown(sheet.past_offset, n_nodes, -1.0),
        side=grown(sheet.side, n_nodes),
        nodes=grown(sheet.nodes, n_nodes),
        tetrahedron_stamp=grown(sheet.tetrahedron_stamp, n_tetrahedra),
        tetrahedron_side=grown(sheet.tetrahedron_side, n_tetrahedra),
    )


@kernel
def begin_sheet(sheet: Sheet) -> None:
    """Forget the last incision and begin another."""
    sheet.number[0] += 1
    sheet.n_nodes[0] = 0
    sheet.front[0] = -1
    sheet.front[1] = -1


@kernel
def touch(sheet: Sheet, node: int) -> None:
    """Make sure that the entries of `node` belong to the current incision."""
    if sheet.node_stamp[node] != sheet.number[0]:
        sheet.node_stamp[node] = sheet.number[0]
        sheet.past_offset[node] = max(sheet.past_offset[node], sheet.offset[node])
        sheet.offset[node] = -1.0
        sheet.side[node] = 0


@kernel
def on_sheet(sheet: Sheet, node: int) -> bool:
    """Whether `node` lies on the sheet of the current incision."""
    return sheet.node_stamp[node] == sheet.number[0] and sheet.offset[node] >= 0.0


@kernel
def past_offset(sheet: Sheet, node: int) -> float:
    """The largest distance of `node` from an earlier sheet that it lies on [m], or -1."""
    if sheet.node_stamp[node] != sheet.number[0]:
        return max(sheet.past_offset[node], sheet.offset[node])
    return sheet.past_offset[node]


@kernel
def side_of(sheet: Sheet, node: int) -> int:
    """Side that `node` was seen on in this incision, or 0."""
    if sheet.node_stamp[node] != sheet.number[0]:
        return 0
    return sheet.side[node]


@kernel
def see_side(sheet: Sheet, node: int, side: int, again: bool) -> None:
    """Note the side that `node` was seen on; `again`: even if it was seen before."""
    touch(sheet, node)
    if again or sheet.side[node] == 0:
        sheet.side[node] = side


@kernel
def decided_side(sheet: Sheet, t: int) -> int:
    """Side that tetrahedron `t` was decided to be on in this incision, or 0."""
    if sheet.tetrahedron_stamp[t] != sheet.number[0]:
        return 0
    return sheet.tetrahedron_side[t]


@kernel
def decide_side(sheet: Sheet, t: int, side: int) -> None:
    """Decide that tetrahedron `t` is on that side."""
    sheet.tetrahedron_stamp[t] = sheet.number[0]
    sheet.tetrahedron_side[t] = side


@kernel
def put_on_sheet(sheet: Sheet, node: int, offset: float) -> None:
    """Let `node` lie on the sheet, that far from where it truly is [m]."""
    touch(sheet, node)
    sheet.offset[node] = offset
    sheet.nodes[sheet.n_nodes[0]] = node
    sheet.n_nodes[0] += 1
