"""Weights that put the force of a contact and its reaction on one line, so that they turn nothing.

A contact is listed once in a time step, and its sides slide past each other meanwhile, rub, and
overlap. A force on a node and the opposite one on the listed point of a face are then on two
parallel lines, and make a torque. So a force acts where its own line meets the face; between two
ridges, where its line meets both.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, axpy, cross, dot, norm, sub, vec3
from tissue.geometry.tetrahedron import Weights

_STEEPEST = 0.2
"""Cosine between a force and the normal of the face, or of the plane along both ridges, below which
the line of the force meets them nowhere near. It then acts at the listed points."""

_LARGEST_SHIFT = 0.3
"""By how much a weight may differ from the listed one. More: deep overlaps act far from where they
are; the stable step is that of the listed weights."""

_NOWHERE = Weights(1e9, 1e9, 1e9, 1e9)


@kernel
def weights_on_line(
    node: IntArray, listed_weight: FloatArray, k: int, x: FloatArray, force: Vec3
) -> Weights:
    """Return the weights of the four nodes of contact `k` for a force that turns nothing.

    Args:
        node: Nodes of the contacts, shape (capacity, 4).
        listed_weight: Weights that they were listed with, shape (capacity, 4).
        k: The contact, not with the floor.
        x: Positions of the nodes [m].
        force: The force on the side of the positive weights [N]; any length but 0.
    """
    a, b, p, q = vec3(x, node[k, 0]), vec3(x, node[k, 1]), vec3(x, node[k, 2]), vec3(x, node[k, 3])
    w = listed_weight
    listed = Weights(w[k, 0], w[k, 1], w[k, 2], w[k, 3])
    if listed.a == 1.0:
        found = _of_node_and_face(a, b, p, q, force)
    else:
        found = _of_ridges(a, b, p, q, force)
    shift = max(
        max(abs(found.a - listed.a), abs(found.b - listed.b)),
        max(abs(found.c - listed.c), abs(found.d - listed.d)),
    )
    return found if shift <= _LARGEST_SHIFT else listed


@kernel
def _of_node_and_face(node: Vec3, a: Vec3, b: Vec3, c: Vec3, force: Vec3) -> Weights:
    """Return the weights of a node and of the point of a face on a line through the node."""
    ab, ac, from_a = sub(b, a), sub(c, a), sub(node, a)
    area = cross(ab, ac)
    square, along = dot(area, area), dot(area, force)
    if not abs(along) > _STEEPEST * norm(area) * norm(force):
        return _NOWHERE
    at = axpy(-dot(area, from_a) / along, force, from_a)
    wb, wc = dot(cross(at, ac), area) / square, dot(cross(ab, at), area) / square
    return Weights(1.0, wb + wc - 1.0, -wb, -wc)


@kernel
def _of_ridges(a: Vec3, b: Vec3, c: Vec3, d: Vec3, force: Vec3) -> Weights:
    """Return the weights of the points of the edges ab and cd on one line along a force."""
    u, v, apart = sub(b, a), sub(d, c), sub(a, c)
    across = cross(u, v)
    along = dot(across, force)
    if not abs(along) > _STEEPEST * norm(across) * norm(force):
        return _NOWHERE
    s = -dot(apart, cross(v, force)) / along
    t = -dot(apart, cross(u, force)) / along
    return Weights(1.0 - s, s, t - 1.0, -t)
