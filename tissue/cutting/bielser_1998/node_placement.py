"""Where the nodes of a split tetrahedron are: at the intersections, moved where parts get thin.

Paper, section 4.2: "the correct geometry of a cut surface is computed by replacing the indicated
edge and face midpoints by the current intersection points". The blade crosses a cut edge in a
point, and a face that the tip passed through in another. It crosses a face that is cut across in a
line, whose middle is taken.

Wherever the points are, the cores and the parts along edges have positive volumes, which are
products of positive weights. The centre need not. With the exact points of a planar cut its four
nodes are in one plane in cases B and E, and where the tip passes near an edge it can be inverted
(7.7 % of random points). Hence two guards: `LIFT`, and where it is not enough, nodes are moved
towards the centroids (`_guard`).
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3
from tissue.cutting.bielser_1998.mesh_records import (
    NO_NODE,
    NOT_CUT,
    Records,
    Table,
    reference_at_face,
)
from tissue.cutting.bielser_1998.template_1_to_17 import (
    CENTRE_CHILD,
    EDGE_NODE,
    FACE_NODE,
    N_LOCAL_NODES,
    is_edge_cut,
)
from tissue.geometry.tetrahedron import signed_volume

EDGE_MARGIN = 0.2
"""Least distance of a node from an end of its edge, as a share of the edge. Nodes that the tip made
are at least half that share of the altitude away from the sides of their face, as nodes of faces
cut across are. Nearer nodes make light, stiff springs: through an organ the highest frequency grew
9 to 10 times with 0.1, 6 to 9 times with 0.2, and 1.5 to 1.9 times with our own scheme."""

LIFT = 0.05
"""Share of the distance to the middle of the two corners that a cut leaves together, by which the
node of a face that is cut across is moved off the cut. Both neighbours of the face have the same
two corners, so they agree. The centre of cases B and E, else flat, gets 0.5 to 1 % of the
volume."""

LEAST_CENTRE = 1e-3
"""Volume of the centre over that of its tetrahedron below which face nodes are moved towards the
centroids, where it is 1/27. In a flatter tetrahedron no point can be located."""

DRAWS = 8
"""Steps in which a face node is moved to the centroid."""


class Placing(Arrays):
    """Scratch: where the nodes of one tetrahedron are."""

    weights: FloatArray = sized(N_LOCAL_NODES, 4)
    """Barycentric weights in the tetrahedron, shape (14, 4)."""
    wanted: FloatArray = sized(4, 4)
    """Weights that the face nodes would have without the guard, shape (4, 4)."""
    is_placed: IntArray = sized(4)
    """Whether the neighbour was split before and placed each face's node, shape (4,)."""
    is_own: IntArray = sized(4)
    """Whether the tetrahedron nevertheless needs a node of its own in each face, shape (4,)."""


@kernel
def place_nodes(records: Records, table: Table, placing: Placing, t: int, code: int) -> bool:
    """Write the weights of the 14 nodes of a tetrahedron; return whether the guard moved any.

    Args:
        records: Cut edges and the nodes that neighbours placed.
        table: The generic split and the lookup table.
        placing: Written.
        t: The tetrahedron.
        code: Its cut-edge code.
    """
    weights = placing.weights
    for node in range(len(weights)):
        for i in range(4):
            weights[node, i] = 0.0
    for i in range(4):
        weights[i, i] = 1.0
    for e in range(6):
        _place_edge_node(records, table, weights, t, e)
    for k in range(4):
        _place_face_node(records, table, placing, t, k, code)
    return _guard(table, placing)


@kernel
def _place_edge_node(records: Records, table: Table, weights: FloatArray, t: int, e: int) -> None:
    edge = records.edges_of[t, e]
    i = table.edge_ends[e, 0]
    j = table.edge_ends[e, 1]
    at = 0.5
    # An edge whose node was made before the blade came keeps it where it is.
    if records.crossed_at[edge] != NOT_CUT and records.edge_held[edge] == 0:
        at = min(max(records.crossed_at[edge], EDGE_MARGIN), 1.0 - EDGE_MARGIN)
    if records.edges[edge, 0] != records.tetrahedra[t, i]:
        at = 1.0 - at
    weights[EDGE_NODE + e, i] = 1.0 - at
    weights[EDGE_NODE + e, j] = at


@kernel
def _place_face_node(
    records: Records, table: Table, placing: Placing, t: int, k: int, code: int
) -> None:
    face = records.faces_of[t, k]
    weights = placing.weights
    node = FACE_NODE + k
    placing.is_own[k] = 0
    placing.is_placed[k] = 0
    detached = table.detached[code, k]
    if records.face_nodes[face, 0] != NO_NODE:
        placing.is_placed[k] = 1
        _from_record(records, table, records.face_weights, weights, t, k)
    elif detached >= 0:
        _place_on_cut(table, weights, k, code, detached)
    else:
        _place_at_tip(records, table, weights, t, k, code)
    for i in range(4):
        placing.wanted[k, i] = weights[node, i]


@kernel
def _place_on_cut(table: Table, weights: FloatArray, k: int, code: int, detached: int) -> None:
    """Put the node in the middle of the line in which the blade meets face `k`, lifted."""
    node = FACE_NODE + k
    for e in range(6):
        if _is_cut_at(table, code, e, k):
            for i in range(4):
                weights[node, i] += 0.5 * (1.0 - LIFT) * weights[EDGE_NODE + e, i]
    for c in range(3):
        corner = table.face_corners[k, c]
        if corner != detached:
            weights[node, corner] += 0.5 * LIFT


@kernel
def _place_at_tip(
    records: Records, table: Table, weights: FloatArray, t: int, k: int, code: int
) -> None:
    """Put the node where the tip passed; in a face not cut or met by no tip, at the centroid."""
    _from_record(records, table, records.tip_weights, weights, t, k)
    node = FACE_NODE + k
    total = 0.0
    is_at_cut = False
    for e in range(6):
        is_at_cut = is_at_cut or _is_cut_at(table, code, e, k)
    for i in range(4):
        total += weights[node, i]
    for c in range(3):
        corner = table.face_corners[k, c]
        if is_at_cut and total > 0.0:
            weights[node, corner] = (
                0.5 * EDGE_MARGIN + (1.0 - 1.5 * EDGE_MARGIN) * weights[node, corner]
            )
        else:
            weights[node, corner] = 1.0 / 3.0


@kernel
def _is_cut_at(table: Table, code: int, e: int, k: int) -> bool:
    """Return whether edge `e` is cut and belongs to face `k`."""
    return is_edge_cut(code, e) and k != table.edge_ends[e, 0] and k != table.edge_ends[e, 1]


@kernel
def _from_record(
    records: Records, table: Table, of_faces: FloatArray, weights: FloatArray, t: int, k: int
) -> None:
    face = records.faces_of[t, k]
    for c in range(3):
        corner = table.face_corners[k, c]
        place = reference_at_face(records, face, records.tetrahedra[t, corner])
        weights[FACE_NODE + k, corner] = of_faces[face, place]


@kernel
def _guard(table: Table, placing: Placing) -> bool:
    """Move face nodes towards the centroids until the centre is not flat; return whether any moved.

    First the nodes that are free to move, together, as little as it takes. Where that is not
    enough, a node that the neighbour has placed is replaced by one for this tetrahedron alone,
    which then hangs.
    """
    if centre_volume(table, placing.weights) >= LEAST_CENTRE:
        return False
    for step in range(1, DRAWS + 1):
        for k in range(4):
            if placing.is_placed[k] == 0:
                _draw(table, placing, k, step / DRAWS)
        if centre_volume(table, placing.weights) >= LEAST_CENTRE:
            return True
    while True:
        best = -1
        largest = -1.0
        for k in range(4):
            if placing.is_placed[k] == 1 and placing.is_own[k] == 0:
                _draw(table, placing, k, 1.0)
                volume = centre_volume(table, placing.weights)
                _draw(table, placing, k, 0.0)
                if volume > largest:
                    best, largest = k, volume
        if best < 0:
            return True
        placing.is_own[best] = 1
        for step in range(1, DRAWS + 1):
            _draw(table, placing, best, step / DRAWS)
            if centre_volume(table, placing.weights) >= LEAST_CENTRE:
                return True


@kernel
def _draw(table: Table, placing: Placing, k: int, share: float) -> None:
    for c in range(3):
        corner = table.face_corners[k, c]
        placing.weights[FACE_NODE + k, corner] = (1.0 - share) * placing.wanted[
            k, corner
        ] + share / 3.0


@kernel
def centre_volume(table: Table, weights: FloatArray) -> float:
    """Return the volume of the centre over that of its tetrahedron; negative if inverted."""
    return 6.0 * signed_volume(
        _in_unit_tetrahedron(weights, table.children[CENTRE_CHILD, 0]),
        _in_unit_tetrahedron(weights, table.children[CENTRE_CHILD, 1]),
        _in_unit_tetrahedron(weights, table.children[CENTRE_CHILD, 2]),
        _in_unit_tetrahedron(weights, table.children[CENTRE_CHILD, 3]),
    )


@kernel
def _in_unit_tetrahedron(weights: FloatArray, node: int) -> Vec3:
    return Vec3(weights[node, 1], weights[node, 2], weights[node, 3])
