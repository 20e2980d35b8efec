"""Strain and Cauchy stress of the body, averaged at its nodes.

They are those of tetrahedra (`tissue.fields.tetrahedron_fields`). A node has the mean strain of the
tetrahedra around it, by volume at rest; and of the virial of forces half of each spring and a
quarter of each tetrahedron, of which its stress is the mean by present volume.
"""

from tissue.core.array_types import FloatArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, norm, sub, vec3
from tissue.elasticity.finite_elements import corner_row
from tissue.elasticity.internal_forces import Elastic, deform
from tissue.elasticity.springs import NO_LENGTH
from tissue.fields.tetrahedron_fields import green_lagrange
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
        strain, volume = green_lagrange(body, t)
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
