"""Normals at the nodes of faces, and which nodes belong to inverted tetrahedra."""

from tissue.contact.faces import NO_FACE, Faces
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, cross, dot, store, sub, vec3
from tissue.mesh.body import Body

Nodes = tuple[int, int, int, int]
"""A node and the corners of a triangle, or the ends of two edges."""


@kernel
def update_normals(
    faces: Faces, body: Body, normal: FloatArray, inverted_step: IntArray, step: int
) -> None:
    """Write the normals of nodes, and note the nodes of tetrahedra that are inverted.

    Args:
        faces: The faces that may touch.
        body: Where the nodes are.
        normal: Outward normal of the nodes of faces, weighted by area [m2]; written.
        inverted_step: When each node was last seen to be of an inverted tetrahedron; written.
        step: Now, as it is written there.
    """
    x = body.positions
    nothing = Vec3(0.0, 0.0, 0.0)
    for at in range(faces.n_places):
        if faces.face[at] != NO_FACE:
            for k in range(3):
                store(normal, faces.node[at, k], nothing)
    for at in range(faces.n_places):
        if faces.face[at] == NO_FACE:
            continue
        i, j, k = faces.node[at, 0], faces.node[at, 1], faces.node[at, 2]
        behind = faces.node[at, 3]
        a = vec3(x, i)
        area = cross(sub(vec3(x, j), a), sub(vec3(x, k), a))
        store(normal, i, add(vec3(normal, i), area))
        store(normal, j, add(vec3(normal, j), area))
        store(normal, k, add(vec3(normal, k), area))
        if not dot(area, sub(a, vec3(x, behind))) > 0.0:
            for node in (i, j, k, behind):
                inverted_step[node] = step


@kernel
def area_at_rest(body: Body, a: int, b: int, c: int) -> Vec3:
    """Return the normal of a triangle of nodes at rest, times twice its area [m2]."""
    p = vec3(body.rest, a)
    return cross(sub(vec3(body.rest, b), p), sub(vec3(body.rest, c), p))


@kernel
def has_inverted(inverted_step: IntArray, step: int, nodes: Nodes) -> bool:
    """Whether one of the nodes was seen at `step` to be of an inverted tetrahedron."""
    a, b, c, d = nodes
    return bool(
        inverted_step[a] == step
        or inverted_step[b] == step
        or inverted_step[c] == step
        or inverted_step[d] == step
    )
