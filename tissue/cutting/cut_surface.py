"""The sheet: the surface that the blade leaves behind in the current incision, and its two sides.

It is a surface in the body at rest, where cracks are closed, tetrahedra are never inverted and
nothing moves: the anchors of the edge move along material points.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.mesh.body import grown


class CutSheet(Arrays):
    """The sheet of the current incision. Entries are valid only where stamped with its number."""

    number: IntCell
    """Number of the incision, from 1."""
    node_stamp: IntArray
    """Incision in which each node's entries were written, shape (node capacity,)."""
    offset: FloatArray
    """Distance of an on-sheet node from the true sheet [m], -1 for others; (node capacity,)."""
    past_offset: FloatArray
    """Largest offset that a node had on earlier sheets [m], -1 if none; (node capacity,)."""
    side: IntArray
    """Side of the sheet that a node was found on, +1 or -1, 0 if unknown; (node capacity,)."""
    nodes: IntArray
    """The nodes on the sheet, in the order in which they came, shape (node capacity,)."""
    n_nodes: IntCell
    """Number of nodes on the sheet."""
    tetrahedron_stamp: IntArray
    """Incision in which each tetrahedron's side was decided, shape (tetrahedron capacity,)."""
    tetrahedron_side: IntArray
    """Side of the sheet that a tetrahedron is on, 0 if undecided; (tetrahedron capacity,)."""
    front: IntArray
    """Last node of the crack front at the tip and at the heel, or -1; shape (2,)."""


def new_sheet(n_nodes: int, n_tetrahedra: int) -> CutSheet:
    """Return a sheet with nothing on it."""
    return CutSheet(
        number=1,
        node_stamp=np.zeros(n_nodes, np.int64),
        offset=np.full(n_nodes, -1.0),
        past_offset=np.full(n_nodes, -1.0),
        side=np.zeros(n_nodes, np.int64),
        nodes=np.zeros(n_nodes, np.int64),
        n_nodes=0,
        tetrahedron_stamp=np.zeros(n_tetrahedra, np.int64),
        tetrahedron_side=np.zeros(n_tetrahedra, np.int64),
        front=np.full(2, -1, np.int64),
    )


def grown_sheet(sheet: CutSheet, n_nodes: int, n_tetrahedra: int) -> CutSheet:
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
def begin_sheet(sheet: CutSheet) -> None:
    """Forget the last incision and begin another."""
    sheet.number += 1
    sheet.n_nodes = 0
    sheet.front[0] = -1
    sheet.front[1] = -1


@kernel
def touch(sheet: CutSheet, node: int) -> None:
    """Reset the entries of `node` unless they belong to the current incision."""
    if sheet.node_stamp[node] != sheet.number:
        sheet.node_stamp[node] = sheet.number
        sheet.past_offset[node] = max(sheet.past_offset[node], sheet.offset[node])
        sheet.offset[node] = -1.0
        sheet.side[node] = 0


@kernel
def on_sheet(sheet: CutSheet, node: int) -> bool:
    """Return whether `node` lies on the sheet of the current incision."""
    is_on: bool = sheet.node_stamp[node] == sheet.number and sheet.offset[node] >= 0.0
    return is_on


@kernel
def past_offset(sheet: CutSheet, node: int) -> float:
    """Return the largest distance of `node` from an earlier sheet that it lies on [m], or -1."""
    offset: float = sheet.past_offset[node]
    if sheet.node_stamp[node] != sheet.number:
        offset = max(sheet.past_offset[node], sheet.offset[node])
    return offset


@kernel
def side_of(sheet: CutSheet, node: int) -> int:
    """Return the side that `node` was found on in this incision, or 0."""
    if sheet.node_stamp[node] != sheet.number:
        return 0
    side: int = sheet.side[node]
    return side


@kernel
def note_side(sheet: CutSheet, node: int, side: int, again: bool) -> None:
    """Note the side that `node` was found on; with `again` also where one is noted already."""
    touch(sheet, node)
    if again or sheet.side[node] == 0:
        sheet.side[node] = side


@kernel
def decided_side(sheet: CutSheet, t: int) -> int:
    """Return the side decided for tetrahedron `t` in this incision, or 0."""
    if sheet.tetrahedron_stamp[t] != sheet.number:
        return 0
    side: int = sheet.tetrahedron_side[t]
    return side


@kernel
def decide_side(sheet: CutSheet, t: int, side: int) -> None:
    """Decide that tetrahedron `t` is on that side."""
    sheet.tetrahedron_stamp[t] = sheet.number
    sheet.tetrahedron_side[t] = side


@kernel
def put_on_sheet(sheet: CutSheet, node: int, offset: float) -> None:
    """Put `node` on the sheet; `offset` is its distance from the true sheet [m]."""
    touch(sheet, node)
    sheet.offset[node] = offset
    sheet.nodes[sheet.n_nodes] = node
    sheet.n_nodes += 1
