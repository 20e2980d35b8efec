"""State of faces that were in contact before a search: they keep it, and parts of them continue it.

Nodes that a cut puts on a face divide it in its own plane. Depth and friction are linear over a
face where the outline of the blade is, and its three contact points are exact for their squares:
so the parts press as the whole did, and hold the same energy. Where they began anew, each cut made
the lips around it slack, and 2 to 5 % of the work of the blade was lost.
"""

import math

from tissue.blade.blade_state import BladeState
from tissue.blade.faces_contact import POINTS, ContactStates, FaceContacts, contact_point
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, norm, sub, vec3
from tissue.mesh.body import Body

_IN_FACE = 1e-6
"""Largest weight outside a face, and distance from its plane per edge, of a node that is on it:
above the rounding of nodes that are put there."""


@kernel
def copy_face(source: ContactStates, target: ContactStates, i: int, j: int) -> None:
    """Copy side, area and energy from row `i` of `source` to row `j` of `target`."""
    target.side[j] = source.side[i]
    target.area[j] = source.area[i]
    target.energy[j] = source.energy[i]


@kernel
def copy_point(source: ContactStates, target: ContactStates, i: int, j: int, q: int) -> None:
    """Copy the state of a contact point.

    Args:
        source: States that are read.
        target: States that are written.
        i: Row of the face in the first.
        j: Its row in the second.
        q: The point.
    """
    target.bevel_shift[j, q] = source.bevel_shift[i, q]
    target.stuck_along[j, q] = source.stuck_along[i, q]
    target.stuck_behind[j, q] = source.stuck_behind[i, q]
    target.sliding_speed[j, q] = source.sliding_speed[i, q]


@kernel
def note_divided(sides: FaceContacts) -> int:
    """Note the faces in contact whose tetrahedra changed since the last search; return how many.

    Their nodes are kept in `node_before`: rows are about to be written again.
    """
    n = 0
    for i in range(sides.n_faces):
        if sides.states.energy[i] > 0.0 and sides.row_of_face[sides.face[i]] != i:
            sides.divided[n] = i
            for corner in range(3):
                sides.node_before[n, corner] = sides.node[i, corner]
            n += 1
    return n


@kernel
def continue_contact(blade: BladeState, body: Body, row: int, n: int) -> bool:
    """Continue the contact of the face that a new one is a part of; return whether there is one.

    Args:
        blade: State of the face is written.
        body: The tissue, which has not moved since the mesh changed.
        row: The new face.
        n: How many faces are noted in `divided`.
    """
    sides = blade.sides
    for k in range(n):
        share = _share_of(sides, body.positions, row, k)
        if share > 0.0:
            before, now, i = sides.states_before, sides.states, sides.divided[k]
            now.side[row] = before.side[i]
            now.area[row] = share * before.area[i]
            for q in range(POINTS):
                at = _place_in(sides, body.positions, row, q, k)
                now.bevel_shift[row, q] = _linear(before.bevel_shift, i, at)
                now.stuck_along[row, q] = _linear(before.stuck_along, i, at)
                now.stuck_behind[row, q] = _linear(before.stuck_behind, i, at)
                now.sliding_speed[row, q] = max(_linear(before.sliding_speed, i, at), 0.0)
            return True
    return False


@kernel
def _share_of(sides: FaceContacts, positions: FloatArray, row: int, k: int) -> float:
    """Return the share of divided face `k` that face `row` is; 0 where it is no part of that."""
    a, normal = vec3(positions, sides.node_before[k, 0]), _normal(sides.node_before, positions, k)
    twice_area = norm(normal)
    share = dot(_normal(sides.node, positions, row), normal)
    if share <= 0.0:  # the other lip, or without an area
        return 0.0
    off_plane = _IN_FACE * twice_area * math.sqrt(twice_area)
    for corner in range(3):
        p = vec3(positions, sides.node[row, corner])
        if abs(dot(sub(p, a), normal)) > off_plane:
            return 0.0
        w = _weights(sides, positions, k, p)
        if min(w.x, min(w.y, w.z)) < -_IN_FACE:
            return 0.0
    return share / (twice_area * twice_area)


@kernel
def _normal(node: IntArray, positions: FloatArray, i: int) -> Vec3:
    """Return the normal of face `i` of `node`, as long as twice its area [m2]."""
    a = vec3(positions, node[i, 0])
    return cross(sub(vec3(positions, node[i, 1]), a), sub(vec3(positions, node[i, 2]), a))


@kernel
def _weights(sides: FaceContacts, positions: FloatArray, k: int, p: Vec3) -> Vec3:
    """Return the barycentric weights of a point [m] in divided face `k`."""
    a = vec3(positions, sides.node_before[k, 0])
    ab = sub(vec3(positions, sides.node_before[k, 1]), a)
    ac = sub(vec3(positions, sides.node_before[k, 2]), a)
    normal, ap = cross(ab, ac), sub(p, a)
    area = dot(normal, normal)
    wb, wc = dot(cross(ap, ac), normal) / area, dot(cross(ab, ap), normal) / area
    return Vec3(1.0 - wb - wc, wb, wc)


@kernel
def _place_in(sides: FaceContacts, positions: FloatArray, row: int, q: int, k: int) -> Vec3:
    """Return the weights of the contact points of divided face `k` at point `q` of face `row`.

    What is linear over the face is at that point the sum of its values at those three.
    """
    w = _weights(sides, positions, k, contact_point(sides, positions, row, q))
    # The weights of corners in contact points are CORNER and OTHER: their inverse.
    return Vec3(2.0 * w.x - 1.0 / 3.0, 2.0 * w.y - 1.0 / 3.0, 2.0 * w.z - 1.0 / 3.0)


@kernel
def _linear(values: FloatArray, i: int, at: Vec3) -> float:
    """Return the value at a place (`_place_in`) from those at the contact points of row `i`."""
    return at.x * values[i, 0] + at.y * values[i, 1] + at.z * values[i, 2]  # type: ignore[no-any-return]
