"""Strain and Cauchy stress of the body, averaged at its nodes.

The Green-Lagrange strain

    E = (F^T F - 1) / 2 = (H + H^T + H^T H) / 2        H = F - 1

is constant in a tetrahedron. A node has the mean of the tetrahedra around it, by volume at rest.

The stress follows from the very forces that move the body. The elastic forces f_k on the corners
x_k of a tetrahedron of volume v, and the pull p of a spring along d, are those of a mean stress
(the virial; Tsai 1979, J. Chem. Phys. 70:1375)

    v sigma = - sum of f_k (x_k - x_0)^T        v sigma = p d d^T / |d|

For linear tetrahedra the first is exact, sigma = P F^T / J, whatever the law, with what has
relaxed and what averaged volumes add. A node has half of each spring and a quarter of each
tetrahedron, of which its stress is the mean by present volume. Viscous stress is not in it.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, dot, norm, sub, vec3
from tissue.elasticity.finite_elements import corner_row, rest_normals
from tissue.elasticity.internal_forces import Elastic, deform
from tissue.elasticity.springs import NO_LENGTH
from tissue.geometry.tetrahedron import Symmetric, largest_eigenvalue, tetrahedron_volume
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


@kernel
def von_mises_stresses(
    elastic: Elastic, body: Body, sums: FloatArray, stresses: FloatArray
) -> None:
    """Write the equivalent stress of von Mises at each node [Pa].

    Args:
        elastic: Scratch of its tetrahedra is written.
        body: The body.
        sums: Scratch, zeros: v sigma as xx, yy, zz, xy, xz, yz, and v; shape (n_nodes, 7).
        stresses: Written, shape (n_nodes,).
    """
    if elastic.has_tetrahedra:
        deform(elastic, body, body.positions)
    for t in range(body.n_tetrahedra):
        _add_tetrahedron(elastic, body, t, sums)
    if elastic.has_springs:
        for node in range(body.n_nodes):
            _add_springs(elastic, body, node, sums)
    for node in range(body.n_nodes):
        stresses[node] = _von_mises(sums, node)


@kernel
def _add_tetrahedron(elastic: Elastic, body: Body, t: int, sums: FloatArray) -> None:
    """Add a quarter of a tetrahedron to each of its nodes."""
    quarter = 0.25 * tetrahedron_volume(body.positions, body.tetrahedra, t)
    for k in range(4):
        sums[body.tetrahedra[t, k], 6] += quarter
    if not elastic.has_tetrahedra:
        return
    x0 = vec3(body.positions, body.tetrahedra[t, 0])
    for corner in range(1, 4):
        d = sub(vec3(body.positions, body.tetrahedra[t, corner]), x0)
        row = corner_row(elastic.solid, t, corner)
        forces = elastic.solid.forces
        f = Vec3(-0.25 * forces[row, 0], -0.25 * forces[row, 1], -0.25 * forces[row, 2])
        for k in range(4):
            _add(sums, body.tetrahedra[t, k], f, d)


@kernel
def _add_springs(elastic: Elastic, body: Body, node: int, sums: FloatArray) -> None:
    """Add half of each spring at a node to it."""
    springs, here = elastic.springs, vec3(body.positions, node)
    for slot in range(springs.first[node], springs.first[node] + springs.count[node]):
        d = sub(vec3(body.positions, springs.neighbour[slot]), here)
        length = norm(d)
        if length > NO_LENGTH:
            half = 0.5 * (springs.stiffness[slot] - springs.rest_pull[slot] / length)
            _add(sums, node, Vec3(half * d.x, half * d.y, half * d.z), d)


@kernel
def _add(sums: FloatArray, node: int, f: Vec3, d: Vec3) -> None:
    """Add the symmetric part of f d^T to v sigma of a node."""
    sums[node, 0] += f.x * d.x
    sums[node, 1] += f.y * d.y
    sums[node, 2] += f.z * d.z
    sums[node, 3] += 0.5 * (f.x * d.y + f.y * d.x)
    sums[node, 4] += 0.5 * (f.x * d.z + f.z * d.x)
    sums[node, 5] += 0.5 * (f.y * d.z + f.z * d.y)


@kernel
def _von_mises(sums: FloatArray, node: int) -> float:
    """Return the equivalent stress [Pa]; 0 where the tetrahedra around the node are inverted."""
    v = sums[node, 6]
    if v <= 0.0:
        return 0.0
    xx, yy, zz = sums[node, 0] / v, sums[node, 1] / v, sums[node, 2] / v
    xy, xz, yz = sums[node, 3] / v, sums[node, 4] / v, sums[node, 5] / v
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    equivalent: float = (0.5 * normal + 3.0 * (xy * xy + xz * xz + yz * yz)) ** 0.5
    return equivalent
