"""Normals at the nodes of faces, and which nodes belong to inverted tetrahedra."""

from tissue.contact.faces import NO_FACE
from tissue.contact.pairs import Nodes
from tissue.contact.state import ContactState
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, cross, dot, store, sub, vec3
from tissue.mesh.body import Body
from tissue.mesh.faces import OUTWARD


@kernel
def update_normals(contact: ContactState, body: Body) -> None:
    """Write the normals of nodes, and note the nodes of tetrahedra that are inverted."""
    faces, normal, x = contact.faces, contact.normal, body.positions
    nothing = Vec3(0.0, 0.0, 0.0)
    for at in range(faces.n_places):
        if faces.face[at] != NO_FACE:
            t, f = faces.face[at] // 4, faces.face[at] % 4
            for k in range(3):
                store(normal, body.tetrahedra[t, OUTWARD[f, k]], nothing)
    for at in range(faces.n_places):
        if faces.face[at] == NO_FACE:
            continue
        t, f = faces.face[at] // 4, faces.face[at] % 4
        i = body.tetrahedra[t, OUTWARD[f, 0]]
        j = body.tetrahedra[t, OUTWARD[f, 1]]
        k = body.tetrahedra[t, OUTWARD[f, 2]]
        behind = body.tetrahedra[t, f]
        a = vec3(x, i)
        area = cross(sub(vec3(x, j), a), sub(vec3(x, k), a))
        store(normal, i, add(vec3(normal, i), area))
        store(normal, j, add(vec3(normal, j), area))
        store(normal, k, add(vec3(normal, k), area))
        if not dot(area, sub(a, vec3(x, behind))) > 0.0:
            for node in (i, j, k, behind):
                contact.inverted_step[node] = contact.step


@kernel
def has_inverted(contact: ContactState, nodes: Nodes) -> bool:
    """Whether one of the nodes belongs to a tetrahedron that is inverted in this step."""
    inverted, step = contact.inverted_step, contact.step
    a, b, c, d = nodes
    return bool(
        inverted[a] == step or inverted[b] == step or inverted[c] == step or inverted[d] == step
    )
