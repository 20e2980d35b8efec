"""Green-Lagrange strain of the body, averaged at its nodes.

    E = (F^T F - 1) / 2 = (H + H^T + H^T H) / 2        H = F - 1

is constant in a tetrahedron. A node has the mean of the tetrahedra around it, by volume at rest.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, dot, sub, vec3
from tissue.elasticity.finite_elements import rest_normals
from tissue.geometry.tetrahedron import Symmetric, largest_eigenvalue
from tissue.mesh.body import Body


@kernel
def largest_principal_strains(body: Body, sums: FloatArray, strains: FloatArray) -> None:
    """Write the largest principal Green-Lagrange strain at each node.

    Args:
        body: The body.
        sums: Scratch, zeros: V E as xx, yy, zz, xy, xz, yz, and V; shape (n_nodes, 7).
        strains: Written, shape (n_nodes,).
    """
    for t in range(body.n_tetrahedra):
        strain, volume = _strain(body, t)
        for k in range(4):
            node = body.tetrahedra[t, k]
            sums[node, 0] += volume * strain.xx
            sums[node, 1] += volume * strain.yy
            sums[node, 2] += volume * strain.zz
            sums[node, 3] += volume * strain.xy
            sums[node, 4] += volume * strain.xz
            sums[node, 5] += volume * strain.yz
            sums[node, 6] += volume
    for node in range(body.n_nodes):
        per = 1.0 / sums[node, 6]
        strains[node] = largest_eigenvalue(
            Symmetric(
                per * sums[node, 0],
                per * sums[node, 1],
                per * sums[node, 2],
                per * sums[node, 3],
                per * sums[node, 4],
                per * sums[node, 5],
            )
        )


@kernel
def _strain(body: Body, t: int) -> tuple[Symmetric, float]:
    """Return E of a tetrahedron, and its volume at rest [m3]."""
    n1, n2, n3, volume = rest_normals(body, t)
    d0 = _displacement(body, body.tetrahedra[t, 0])
    d1 = sub(_displacement(body, body.tetrahedra[t, 1]), d0)
    d2 = sub(_displacement(body, body.tetrahedra[t, 2]), d0)
    d3 = sub(_displacement(body, body.tetrahedra[t, 3]), d0)
    per = 1.0 / (6.0 * volume)
    # Columns of H: displacements per length along x, y and z.
    x = _column(per, d1, d2, d3, n1.x, n2.x, n3.x)
    y = _column(per, d1, d2, d3, n1.y, n2.y, n3.y)
    z = _column(per, d1, d2, d3, n1.z, n2.z, n3.z)
    strain = Symmetric(
        x.x + 0.5 * dot(x, x),
        y.y + 0.5 * dot(y, y),
        z.z + 0.5 * dot(z, z),
        0.5 * (x.y + y.x + dot(x, y)),
        0.5 * (x.z + z.x + dot(x, z)),
        0.5 * (y.z + z.y + dot(y, z)),
    )
    return strain, volume


@kernel
def _displacement(body: Body, node: int) -> Vec3:
    return sub(vec3(body.positions, node), vec3(body.rest, node))


@kernel
def _column(per: float, d1: Vec3, d2: Vec3, d3: Vec3, n1: float, n2: float, n3: float) -> Vec3:
    return Vec3(
        per * (n1 * d1.x + n2 * d2.x + n3 * d3.x),
        per * (n1 * d1.y + n2 * d2.y + n3 * d3.y),
        per * (n1 * d1.z + n2 * d2.z + n3 * d3.z),
    )
