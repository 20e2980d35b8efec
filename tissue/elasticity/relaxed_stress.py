"""The stress that has relaxed in each tetrahedron: how it is kept, and its part in the forces.

Of each term of a Prony series a tetrahedron keeps seven numbers: a second Piola-Kirchhoff stress R,
which is symmetric and does not change as the body turns, and a pressure r. Together they take

    F R + r cof F

from the first Piola-Kirchhoff stress of the elastic law. r is apart from R since volumes are
averaged around nodes: the elastic pressure of a tetrahedron does not follow from its own F, and as
a part of R it was unstable.

Where a share of the shear is averaged around nodes (`tissue.elasticity.averaged_shear`), nodes keep
an R of their own, which follows from their F, and takes F R from their stress.

Forces need the sum over all terms, which is kept with the terms.
"""

from tissue.core.array_types import FloatArray, IntArray, SlotArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import gathered_like, load_block, splat, width_of
from tissue.core.vec3 import Vec3
from tissue.elasticity.finite_elements import N_RELAXED, VOLUME, Solid, is_graded, shape_place
from tissue.elasticity.graded import own_share_of_one
from tissue.elasticity.stars import is_averaged, tetrahedron_of_slot

PRESSURE = 6
"""Place of r among the numbers of a tetrahedron. Before it are xx, yy, zz, yz, xz and xy of R."""


@inlined
def relaxes(solid: Solid) -> bool:
    """Return whether the stress of the tetrahedra relaxes."""
    return solid.n_terms > 0


@kernel
def relaxed_place(solid: Solid, t: int, which: int) -> int:
    """Return where number `which` of tetrahedron, or node, `t` is in `relaxed`."""
    width = width_of(solid.shape)
    place: int = width * (N_RELAXED * (t // width) + which) + t % width
    return place


@kernel
def relaxed_term_place(solid: Solid, t: int, term: int, which: int) -> int:
    """Return where number `which` of a term in tetrahedron, or node, `t` is."""
    width, n_terms = width_of(solid.shape), solid.n_terms
    row = N_RELAXED * (n_terms * (t // width) + term) + which
    place: int = width * row + t % width
    return place


@inlined
def of_term(
    solid: Solid, numbers: FloatArray, series: SlotArray, block: int, term: int, like: Lanes
) -> Lanes:
    """Return a number of a term of a block, of tetrahedra or nodes.

    Args:
        solid: The Prony series.
        numbers: One of its three arrays, `relaxing_shares` and so on.
        series: `Solid.series`, or `Solid.node_series`.
        block: The block.
        term: The term.
        like: A vector of the type of numbers.
    """
    if not is_graded(solid):
        return splat(numbers[term], like)
    first = width_of(solid.shape) * (solid.n_terms * block + term)
    return gathered_like(like, numbers, series, first)


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
    relaxed: FloatArray,
    first: int,
    v: Lanes,
    stress: tuple[Vec3, Vec3, Vec3],
    gradient: tuple[Vec3, Vec3, Vec3],
) -> tuple[Vec3, Vec3, Vec3]:
    """Return P + v F R.

    Args:
        relaxed: `Solid.relaxed`, or `Solid.node_relaxed`.
        first: First of the tetrahedra, or nodes, of a vector.
        v: Factor of F R.
        stress: Rows of P.
        gradient: Rows of H = F - 1.
    """
    rx, ry, rz = rows_of_stress(relaxed, N_RELAXED * first)
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
            for term in range(solid.n_terms):
                value = solid.relaxed_terms[relaxed_term_place(solid, parent, term, which)]
                solid.relaxed_terms[relaxed_term_place(solid, child, term, which)] = value


@kernel
def inherit_at_nodes(solid: Solid, nodes: IntArray, n: int) -> None:
    """Give nodes whose tetrahedra have changed what has relaxed in these, by volume.

    The average of F changes as well. At small strain R of a node is that average, by the ratio of
    the shares of the shear, in any case.

    Args:
        solid: Written; the rows of the nodes are up to date.
        nodes: The nodes.
        n: How many of them.
    """
    n_terms, share = solid.n_terms, solid.law.shear_of_nodes
    share /= 1.0 - share
    for i in range(n):
        node = nodes[i]
        for which in range(PRESSURE):
            total = 0.0
            for term in range(n_terms):
                value = 0.0
                for slot in range(solid.first[node], solid.first[node] + solid.count[node]):
                    if not is_averaged(solid, slot):
                        continue
                    t = tetrahedron_of_slot(solid, slot)
                    volume = 0.25 * solid.shape[shape_place(solid, t, VOLUME)]
                    if is_graded(solid):
                        own = own_share_of_one(solid, t)
                        volume *= (1.0 - solid.law.shear_of_nodes) / own
                    value += volume * solid.relaxed_terms[relaxed_term_place(solid, t, term, which)]
                value *= share / solid.node_volume[node]
                solid.node_relaxed_terms[relaxed_term_place(solid, node, term, which)] = value
                total += value
            solid.node_relaxed[relaxed_place(solid, node, which)] = total
