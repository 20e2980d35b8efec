"""The stress that has relaxed in each tetrahedron: how it is kept, and its part in the forces.

Of each term of a Prony series a tetrahedron keeps seven numbers: a second Piola-Kirchhoff stress R,
which is symmetric and does not change as the body turns, and a pressure r. Together they take

    F R + r cof F

from the first Piola-Kirchhoff stress of the elastic law. r is apart from R since volumes are
averaged around nodes: the elastic pressure of a tetrahedron does not follow from its own F, and as
a part of R it was unstable.

Forces need the sum over all terms, which is kept with the terms.
"""

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import load_block, splat, width_of
from tissue.core.vec3 import Vec3
from tissue.elasticity.finite_elements import N_RELAXED, Solid

PRESSURE = 6
"""Place of r among the numbers of a tetrahedron. Before it are xx, yy, zz, yz, xz and xy of R."""


@inlined
def relaxes(solid: Solid) -> bool:
    """Return whether the stress of the tetrahedra relaxes."""
    return len(solid.relaxing_shares) > 0


@kernel
def relaxed_place(solid: Solid, t: int, which: int) -> int:
    """Return where number `which` of tetrahedron `t` is in `relaxed`."""
    width = width_of(solid.shape)
    place: int = width * (N_RELAXED * (t // width) + which) + t % width
    return place


@kernel
def relaxed_term_place(solid: Solid, t: int, term: int, which: int) -> int:
    """Return where number `which` of a term in tetrahedron `t` is in `relaxed_terms`."""
    width, n_terms = width_of(solid.shape), len(solid.relaxing_shares)
    row = N_RELAXED * (n_terms * (t // width) + term) + which
    place: int = width * row + t % width
    return place


@inlined
def rows_of_stress(values: FloatArray, at: int) -> tuple[Vec3, Vec3, Vec3]:
    """Return the rows of the R of a block whose numbers begin at `at` [Pa]."""
    width = width_of(values)
    xy, xz = load_block(values, at + 5 * width), load_block(values, at + 4 * width)
    yz = load_block(values, at + 3 * width)
    return (
        Vec3(load_block(values, at), xy, xz),
        Vec3(xy, load_block(values, at + width), yz),
        Vec3(xz, yz, load_block(values, at + 2 * width)),
    )


@inlined
def relaxed_pressure(solid: Solid, block: int) -> Lanes:
    """Return the sum of r over all terms, of the tetrahedra of a block [Pa]."""
    return load_block(solid.relaxed, width_of(solid.shape) * (N_RELAXED * block + PRESSURE))


@inlined
def with_relaxed(
    solid: Solid,
    block: int,
    v: Lanes,
    stress: tuple[Vec3, Vec3, Vec3],
    gradient: tuple[Vec3, Vec3, Vec3],
) -> tuple[Vec3, Vec3, Vec3]:
    """Return -V P less -V F R, from the rows of -V P without it.

    Args:
        solid: The tetrahedra.
        block: A block of them.
        v: Their volumes [m3].
        stress: Rows of -V P [N m].
        gradient: Rows of H = F - 1.
    """
    at = width_of(solid.shape) * N_RELAXED * block
    rx, ry, rz = rows_of_stress(solid.relaxed, at)
    px, py, pz = stress
    x, y, z = gradient
    one = splat(1.0, v)
    return (
        _with_product(px, v, Vec3(x.x + one, x.y, x.z), rx, ry, rz),
        _with_product(py, v, Vec3(y.x, y.y + one, y.z), rx, ry, rz),
        _with_product(pz, v, Vec3(z.x, z.y, z.z + one), rx, ry, rz),
    )


@inlined
def _with_product(p: Vec3, v: Lanes, f: Vec3, rx: Vec3, ry: Vec3, rz: Vec3) -> Vec3:
    """Return the row p + V f R; R is symmetric."""
    return Vec3(
        p.x + v * (f.x * rx.x + f.y * rx.y + f.z * rx.z),
        p.y + v * (f.x * ry.x + f.y * ry.y + f.z * ry.z),
        p.z + v * (f.x * rz.x + f.y * rz.y + f.z * rz.z),
    )


@kernel
def inherit_relaxed(solid: Solid, children: IntArray, n: int) -> None:
    """Give tetrahedra that are parts of others what has relaxed in these.

    A part is deformed as its parent, so that the split changes no stress.

    Args:
        solid: Written.
        children: Each child and its parent, parents before their children; shape (any, 2).
        n: How many of them.
    """
    for i in range(n):
        child, parent = children[i, 0], children[i, 1]
        for which in range(N_RELAXED):
            value = solid.relaxed[relaxed_place(solid, parent, which)]
            solid.relaxed[relaxed_place(solid, child, which)] = value
            for term in range(len(solid.relaxing_shares)):
                value = solid.relaxed_terms[relaxed_term_place(solid, parent, term, which)]
                solid.relaxed_terms[relaxed_term_place(solid, child, term, which)] = value
