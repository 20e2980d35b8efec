"""The cut-edge code and the generic 1:17 split of a tetrahedron (paper, sections 3 and 4.2).

The corners A, B, C, D are the local nodes 0 to 3. The code has a bit for each edge, set where the
blade has crossed it, in the printed order AB BC BD AC CD AD, with AB the most significant: 48 =
110000 of Figure 7 is AB and BC. The split is that of Figures 4 and 5.

The split has 14 nodes: the four corners, one on each edge and one in each face. Its 17
tetrahedra make five parts: the one of a corner holds the corner's core and three tetrahedra along
the edges that leave it; the fifth is the centre.

    core of A        (A, node of ABC, node of ABD, node of ACD)       four of them
    A's part of AB   (A, node of AB, node of ABC, node of ABD)        twelve of them
    centre           (nodes of ABC, ABD, ACD, BCD)                    one of them

Two parts touch in one triangle, of ten: I(AB), node of AB and nodes of the two faces at AB, between
the corners A and B; J(A), the nodes of the three faces at A, between corner A and the centre.
"""

from typing import NamedTuple

import numpy as np

from tissue.core.array_types import IntArray
from tissue.core.jit import kernel

CORNERS = "ABCD"

EDGES = ((0, 1), (1, 2), (1, 3), (0, 2), (2, 3), (0, 3))
"""Corners of each edge, in the order of the bits."""

FACES = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
"""Corners of each face. Face k lies opposite corner k, as everywhere in `tissue`."""

N_CODES = 64
"""Number of codes: 6 bits."""


def code_of(*edges: str) -> int:
    """Return the code of the edges with these names, for example "AB" and "BC".

    The table of cases is made of codes as it is imported, so no kernel is called for its bits.
    """
    numbers = {edge_named(name) for name in edges}
    return int("".join("1" if edge in numbers else "0" for edge in range(len(EDGES))), 2)


def edge_named(name: str) -> int:
    """Return the number of the edge with that name: two corners, in either order."""
    a, b = sorted(CORNERS.index(corner) for corner in name)
    return EDGES.index((a, b))


def face_named(name: str) -> int:
    """Return the number of the face with that name: three corners."""
    return FACES.index(tuple(sorted(CORNERS.index(corner) for corner in name)))


@kernel
def bit_of(edge: int) -> int:
    """Place of the bit of an edge, counted from the least significant."""
    return 5 - edge


@kernel
def is_edge_cut(code: int, edge: int) -> bool:
    """Return whether an edge is cut, by the code of its tetrahedron."""
    return (code >> bit_of(edge)) & 1 == 1


N_CHILDREN = 17
"""Tetrahedra that one becomes."""

N_LOCAL_NODES = 14
"""Nodes of the split: corners, one on each edge, one in each face."""

EDGE_NODE, FACE_NODE = 4, 10
"""Local numbers of the first edge node and the first face node; the corners are 0 to 3."""

CENTRE = 4
"""The part that belongs to no corner."""

CENTRE_CHILD = 16
"""The child that is the centre."""

FIRST_J = 6
"""Number of the first triangle J. Before it come those I, in the order of the code's bits."""


class Presplit(NamedTuple):
    """The split by local numbers. Face f of a child lies opposite its node f, as everywhere."""

    children: IntArray
    """Local nodes of each child, of positive volume where ABCD has one; shape (17, 4)."""
    part: IntArray
    """Corner that each child belongs to, or CENTRE; shape (17,)."""
    inner: IntArray
    """Cell behind each face of each child: 4 * child + its face, or -1 on a face of ABCD; shape
    (17, 4)."""
    triangle: IntArray
    """Which of the ten triangles between parts each face is, or -1; shape (17, 4)."""
    along: IntArray
    """Child of corner i along the edge to corner j, -1 for i = j; shape (4, 4)."""
    outer: IntArray
    """Which face of each child lies on face k of ABCD, or -1; shape (17, 4)."""


def _edge_node(i: int, j: int) -> int:
    return EDGE_NODE + EDGES.index((min(i, j), max(i, j)))


def _children() -> tuple[list[list[int]], list[int], IntArray]:
    children, part = [], []
    along = np.full((4, 4), -1)
    for i in range(4):
        children.append([i, *(FACE_NODE + k for k in range(4) if k != i)])
        part.append(i)
    for i in range(4):
        for j in range(4):
            if i != j:
                along[i, j] = len(children)
                faces = [FACE_NODE + k for k in range(4) if k not in (i, j)]
                children.append([i, _edge_node(i, j), *faces])
                part.append(i)
    children.append([FACE_NODE + k for k in range(4)])
    part.append(CENTRE)
    return children, part, along


def generic_weights() -> np.ndarray:
    """Return the barycentric weights of the nodes at midpoints and centroids, shape (14, 4)."""
    weights = np.zeros((N_LOCAL_NODES, 4))
    weights[:4] = np.eye(4)
    for e, ends in enumerate(EDGES):
        weights[EDGE_NODE + e, list(ends)] = 1.0 / 2.0
    for k, corners in enumerate(FACES):
        weights[FACE_NODE + k, list(corners)] = 1.0 / 3.0
    return weights


def _turned_positive(children: list[list[int]]) -> IntArray:
    turned = np.array(children)
    inverted = np.linalg.det(generic_weights()[turned]) < 0.0
    turned[inverted, 2], turned[inverted, 3] = turned[inverted, 3], turned[inverted, 2]
    return turned


def _triangle_between(nodes: frozenset[int], one: int, other: int) -> int:
    if one == other:
        return -1
    if CENTRE in (one, other):
        return FIRST_J + min(one, other)
    return min(nodes) - EDGE_NODE


def presplit() -> Presplit:
    """Return the split, with all that follows from its nodes."""
    listed, parts, along = _children()
    children = _turned_positive(listed)
    owners: dict[frozenset[int], list[int]] = {}
    for c, nodes in enumerate(children.tolist()):
        for f in range(4):
            owners.setdefault(frozenset(nodes) - {nodes[f]}, []).append(4 * c + f)
    inner, triangle, outer = (np.full((N_CHILDREN, 4), -1) for _ in range(3))
    for nodes_of_face, halves in owners.items():
        first = divmod(halves[0], 4)
        if len(halves) == 1:
            k = max(nodes_of_face) - FACE_NODE
            outer[first[0], k] = first[1]
            continue
        second = divmod(halves[1], 4)
        between = _triangle_between(nodes_of_face, parts[first[0]], parts[second[0]])
        inner[first], inner[second] = halves[1], halves[0]
        triangle[first] = triangle[second] = between
    return Presplit(children, np.array(parts), inner, triangle, along, outer)


PRESPLIT = presplit()
