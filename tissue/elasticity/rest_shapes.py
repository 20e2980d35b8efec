"""The shapes of tetrahedra at rest, and the area vectors of their faces."""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, cross, dot, scale, sub, vec3
from tissue.elasticity.finite_elements import VOLUME, Solid, node_place, shape_place
from tissue.mesh.body import Body


@kernel
def build_tetrahedra(solid: Solid, body: Body, tetrahedra: IntArray, n: int) -> None:
    """Write the rest shapes of the first `n` of `tetrahedra`."""
    for i in range(n):
        t = tetrahedra[i]
        for k in range(4):
            solid.nodes[node_place(solid, t, k)] = body.tetrahedra[t, k]
        n1, n2, n3, volume = rest_normals(body, t)
        per = 1.0 / (6.0 * volume)
        _store_gradient(solid, t, 0, scale(per, n1))
        _store_gradient(solid, t, 3, scale(per, n2))
        _store_gradient(solid, t, 6, scale(per, n3))
        solid.shape[shape_place(solid, t, VOLUME)] = volume


@kernel
def _store_gradient(solid: Solid, t: int, first: int, gradient: Vec3) -> None:
    solid.shape[shape_place(solid, t, first)] = gradient.x
    solid.shape[shape_place(solid, t, first + 1)] = gradient.y
    solid.shape[shape_place(solid, t, first + 2)] = gradient.z


@kernel
def rest_normals(body: Body, t: int) -> tuple[Vec3, Vec3, Vec3, float]:
    """Return 6 V grad N of nodes 1, 2 and 3 of a tetrahedron at rest [m2], and V [m3]."""
    return normals(body, body.rest, t)


@kernel
def normals(body: Body, points: FloatArray, t: int) -> tuple[Vec3, Vec3, Vec3, float]:
    """Return twice the area vectors of the faces opposite nodes 1, 2 and 3, and the volume.

    Args:
        body: For the nodes of the tetrahedron.
        points: Where the nodes are [m].
        t: The tetrahedron.
    """
    x0 = vec3(points, body.tetrahedra[t, 0])
    d1 = sub(vec3(points, body.tetrahedra[t, 1]), x0)
    d2 = sub(vec3(points, body.tetrahedra[t, 2]), x0)
    d3 = sub(vec3(points, body.tetrahedra[t, 3]), x0)
    n1 = cross(d2, d3)
    return n1, cross(d3, d1), cross(d1, d2), dot(d1, n1) / 6.0
