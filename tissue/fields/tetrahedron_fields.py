"""Strain and Cauchy stress of each tetrahedron.

The Green-Lagrange strain is constant in a tetrahedron:

    E = (F^T F - 1) / 2 = (H + H^T + H^T H) / 2        H = F - 1

The stress follows from the very forces that move the body. The elastic forces f_k on the corners
x_k of a tetrahedron of volume v, and the pull p of a spring along d, are those of a mean stress
(the virial; Tsai 1979, J. Chem. Phys. 70:1375)

    v sigma = - sum of f_k (x_k - x_0)^T        v sigma = p d d^T / |d|

For linear tetrahedra the first is exact, sigma = P F^T / J, whatever the law, with what has
relaxed and what averaged volumes and shear add: f_k = - v sigma grad N_k gives the forces back.
Each tetrahedron beside a spring has made it stiffer by its own volume (van Gelder), and has that
share of its pull; so the virials of all tetrahedra are those of all springs. Viscous stress is not
in it, nor is what keeps tetrahedra of springs from turning inside out.
"""

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, dot, norm, sub, vec3
from tissue.elasticity.finite_elements import corner_row
from tissue.elasticity.internal_forces import Elastic, deform
from tissue.elasticity.rest_shapes import rest_normals
from tissue.elasticity.springs import NO_LENGTH
from tissue.geometry.tetrahedron import Symmetric, largest_eigenvalue, tetrahedron_volume
from tissue.mesh.body import INSIDE_TOLERANCE, Body, holder_near


@kernel
def strains_of_tetrahedra(body: Body, strains: FloatArray) -> None:
    """Write the Green-Lagrange strain of each tetrahedron.

    Args:
        body: The body.
        strains: Written, shape (n_tetrahedra, 3, 3).
    """
    for t in range(body.n_tetrahedra):
        e, _ = green_lagrange(body, t)
        strains[t, 0, 0], strains[t, 1, 1], strains[t, 2, 2] = e.xx, e.yy, e.zz
        strains[t, 0, 1], strains[t, 1, 0] = e.xy, e.xy
        strains[t, 0, 2], strains[t, 2, 0] = e.xz, e.xz
        strains[t, 1, 2], strains[t, 2, 1] = e.yz, e.yz


@kernel
def mark_strained(
    body: Body, points: FloatArray, holders: IntArray, limit: float, marked: BoolArray
) -> None:
    """Mark material points where the largest principal strain is above a limit.

    Args:
        body: The body.
        points: The points in the body at rest [m], shape (n, 3).
        holders: The tetrahedron that held each last, or -1 where it is not known, shape (n,);
            written where another does now.
        limit: The limit, above 0.
        marked: Those that are marked already are not looked at, shape (n,).
    """
    for i in range(len(holders)):
        if marked[i]:
            continue
        p, t = vec3(points, i), holders[i]
        shape = rest_normals(body, max(t, 0))
        if t < 0 or not _holds(body, t, shape, p):
            t = holder_near(body, p, t)
            holders[i], shape = t, rest_normals(body, t)
        e = _strain(body, t, shape)
        square = e.xx * e.xx + e.yy * e.yy + e.zz * e.zz
        square += 2.0 * (e.xy * e.xy + e.xz * e.xz + e.yz * e.yz)
        # It is the sum of the squares of all principal strains.
        if square > limit * limit and largest_eigenvalue(e) > limit:
            marked[i] = True


@kernel
def _holds(body: Body, t: int, shape: tuple[Vec3, Vec3, Vec3, float], p: Vec3) -> bool:
    """Return whether a tetrahedron holds a place of the body at rest [m]; `shape`: its normals."""
    n1, n2, n3, volume = shape
    offset = sub(p, vec3(body.rest, body.tetrahedra[t, 0]))
    b, c, d = dot(n1, offset), dot(n2, offset), dot(n3, offset)
    a = 6.0 * volume - b - c - d
    return min(min(a, b), min(c, d)) >= -INSIDE_TOLERANCE * 6.0 * volume


@kernel
def green_lagrange(body: Body, t: int) -> tuple[Symmetric, float]:
    """Return E of a tetrahedron, and its volume at rest [m3]."""
    shape = rest_normals(body, t)
    return _strain(body, t, shape), shape[3]


@kernel
def _strain(body: Body, t: int, shape: tuple[Vec3, Vec3, Vec3, float]) -> Symmetric:
    """Return E of a tetrahedron with these normals."""
    n1, n2, n3, volume = shape
    d0 = _displacement(body, body.tetrahedra[t, 0])
    d1 = sub(_displacement(body, body.tetrahedra[t, 1]), d0)
    d2 = sub(_displacement(body, body.tetrahedra[t, 2]), d0)
    d3 = sub(_displacement(body, body.tetrahedra[t, 3]), d0)
    per = 1.0 / (6.0 * volume)
    # Columns of H: displacements per length along x, y and z.
    x = _column(per, d1, d2, d3, n1.x, n2.x, n3.x)
    y = _column(per, d1, d2, d3, n1.y, n2.y, n3.y)
    z = _column(per, d1, d2, d3, n1.z, n2.z, n3.z)
    return Symmetric(
        x.x + 0.5 * dot(x, x),
        y.y + 0.5 * dot(y, y),
        z.z + 0.5 * dot(z, z),
        0.5 * (x.y + y.x + dot(x, y)),
        0.5 * (x.z + z.x + dot(x, z)),
        0.5 * (y.z + z.y + dot(y, z)),
    )


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
def stresses_of_tetrahedra(elastic: Elastic, body: Body, stresses: FloatArray) -> None:
    """Write the elastic Cauchy stress of each tetrahedron [Pa]; 0 of one that is inside out.

    Args:
        elastic: Scratch of its tetrahedra is written.
        body: The body.
        stresses: Written, zeros at first; shape (n_tetrahedra, 3, 3).
    """
    if elastic.has_tetrahedra:
        deform(elastic, body, body.positions)
    for t in range(body.n_tetrahedra):
        volume = tetrahedron_volume(body.positions, body.tetrahedra, t)
        if volume <= 0.0:
            continue
        per = 1.0 / volume
        if elastic.has_tetrahedra:
            _add_corners(elastic, body, t, per, stresses)
        if elastic.has_springs:
            modulus = body.materials.spring_modulus[body.material[t]]
            _add_edges(body, t, per * modulus, stresses)


@kernel
def _add_corners(elastic: Elastic, body: Body, t: int, per: float, stresses: FloatArray) -> None:
    """Add the stress of the forces on the corners of a tetrahedron, `per` present volume [1/m3]."""
    x0, forces = vec3(body.positions, body.tetrahedra[t, 0]), elastic.solid.forces
    for corner in range(1, 4):
        d = sub(vec3(body.positions, body.tetrahedra[t, corner]), x0)
        row = corner_row(elastic.solid, t, corner)
        for i in range(3):
            pull = -per * forces[row, i]
            stresses[t, i, 0] += pull * d.x
            stresses[t, i, 1] += pull * d.y
            stresses[t, i, 2] += pull * d.z


@kernel
def _add_edges(body: Body, t: int, modulus: float, stresses: FloatArray) -> None:
    """Add the stress of a tetrahedron's shares of springs, of a modulus per present volume."""
    at_rest = modulus * tetrahedron_volume(body.rest, body.tetrahedra, t)
    for a in range(3):
        for b in range(a + 1, 4):
            i, j = body.tetrahedra[t, a], body.tetrahedra[t, b]
            d = sub(vec3(body.positions, j), vec3(body.positions, i))
            length, rest = norm(d), norm(sub(vec3(body.rest, j), vec3(body.rest, i)))
            if length > NO_LENGTH:
                pull = at_rest / (rest * rest) * (1.0 - rest / length)
                _add_product(stresses, t, pull, d)


@kernel
def _add_product(stresses: FloatArray, t: int, factor: float, d: Vec3) -> None:
    """Add a factor times d d^T."""
    stresses[t, 0, 0] += factor * d.x * d.x
    stresses[t, 1, 1] += factor * d.y * d.y
    stresses[t, 2, 2] += factor * d.z * d.z
    stresses[t, 0, 1] += factor * d.x * d.y
    stresses[t, 1, 0] += factor * d.x * d.y
    stresses[t, 0, 2] += factor * d.x * d.z
    stresses[t, 2, 0] += factor * d.x * d.z
    stresses[t, 1, 2] += factor * d.y * d.z
    stresses[t, 2, 1] += factor * d.y * d.z
