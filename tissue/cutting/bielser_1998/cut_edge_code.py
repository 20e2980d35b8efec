"""The cut-edge code: which edges of a tetrahedron the blade has crossed (paper, section 3).

The corners A, B, C, D are the local nodes 0 to 3. The six bits stand in the printed order,
AB BC BD AC CD AD, with AB the most significant: Figure 7's 48 = 110000 is AB and BC.
"""

from tissue.core.jit import kernel

CORNERS = "ABCD"

EDGES = ((0, 1), (1, 2), (1, 3), (0, 2), (2, 3), (0, 3))
"""Corners of each edge, in the order of the bits."""

FACES = ((1, 2, 3), (0, 2, 3), (0, 1, 3), (0, 1, 2))
"""Corners of each face. Face k lies opposite corner k, as everywhere in `tissue`."""

N_CODES = 64
"""Number of codes: 6 bits."""

WHOLE, TIP, FULL = 0, 1, 2
"""State of a face: not cut; cut up to a point inside it, where the tip passed through; cut across.
A face that the tip pierced and of which no edge is cut (state 3 of the paper) has no edge code."""


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


def face_state(code: int, face: int) -> int:
    """Return WHOLE, TIP or FULL: the number of cut edges of the face.

    Where the blade has left the tetrahedron, the cut edges determine the states of the faces: a
    plane crosses none or two edges of a face, and where the tip passed through the face one of the
    two stays uncut.
    """
    return sum(is_edge_cut(code, e) for e, ends in enumerate(EDGES) if face not in ends)
