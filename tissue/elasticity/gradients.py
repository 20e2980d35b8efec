"""H, the gradient of the displacement in tetrahedra, a block at a time: F = 1 + H."""

from tissue.core.array_types import FloatArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd import WIDTH, Lanes, point
from tissue.core.simd_blocks import load_block, store_block, width_of
from tissue.core.simd_points import points_of_rows, store_row
from tissue.core.simd_rows import natural
from tissue.core.vec3 import Vec3
from tissue.elasticity.finite_elements import N_SHAPE, Solid
from tissue.elasticity.stress import MatrixRows
from tissue.mesh.body import Body


@kernel
def displacements(solid: Solid, body: Body, positions: FloatArray, begin: int, end: int) -> None:
    """Write the displacements of the nodes from `begin` to `end` from rest to `positions` [m].

    Args:
        solid: Written.
        body: Rest positions.
        positions: Positions of the nodes [m].
        begin: First of the nodes.
        end: End of them.
    """
    for i in range(begin, end):
        node = natural(i)
        store_row(solid.displacement, node, point(positions, node) - point(body.rest, node))


@inlined
def gradient_of_displacement(solid: Solid, block: int) -> MatrixRows:
    """Return the rows of H of the tetrahedra of a block, after `displacements`."""
    x0, y0, z0 = _corners(solid, block, 0)
    x1, y1, z1 = _corners(solid, block, 1)
    x2, y2, z2 = _corners(solid, block, 2)
    x3, y3, z3 = _corners(solid, block, 3)
    g1 = gradient_of_shape(solid, block, 0)
    g2 = gradient_of_shape(solid, block, 3)
    g3 = gradient_of_shape(solid, block, 6)
    return (
        _row_of_gradient(x1 - x0, x2 - x0, x3 - x0, g1, g2, g3),
        _row_of_gradient(y1 - y0, y2 - y0, y3 - y0, g1, g2, g3),
        _row_of_gradient(z1 - z0, z2 - z0, z3 - z0, g1, g2, g3),
    )


@inlined
def keeps_gradients(solid: Solid) -> bool:
    """Return whether H is kept between two loops over the tetrahedra, not computed twice.

    In single precision that takes a sixth less time. Doubles would not fit the cache.
    """
    return width_of(solid.shape) > WIDTH


@inlined
def keep_gradient(solid: Solid, block: int, gradient: MatrixRows) -> None:
    """Keep the rows of H of the tetrahedra of a block."""
    width = width_of(solid.shape)
    at = 9 * width * block
    store_vector(solid.gradient, at, gradient[0])
    store_vector(solid.gradient, at + 3 * width, gradient[1])
    store_vector(solid.gradient, at + 6 * width, gradient[2])


@inlined
def store_vector(rows: FloatArray, at: int, v: Vec3) -> None:
    """Write the x, y and z of the tetrahedra of a block to three rows, the first at `at`."""
    width = width_of(rows)
    store_block(rows, at, v.x)
    store_block(rows, at + width, v.y)
    store_block(rows, at + 2 * width, v.z)


@inlined
def load_vector(rows: FloatArray, at: int) -> Vec3:
    """Return what `store_vector` wrote."""
    width = width_of(rows)
    return Vec3(
        load_block(rows, at), load_block(rows, at + width), load_block(rows, at + 2 * width)
    )


@inlined
def known_gradient(solid: Solid, block: int) -> MatrixRows:
    """Return the rows of H of the tetrahedra of a block, after `displacement_gradients`."""
    if keeps_gradients(solid):
        width = width_of(solid.shape)
        at = 9 * width * block
        return (
            load_vector(solid.gradient, at),
            load_vector(solid.gradient, at + 3 * width),
            load_vector(solid.gradient, at + 6 * width),
        )
    return gradient_of_displacement(solid, block)


@inlined
def _row_of_gradient(d1: Lanes, d2: Lanes, d3: Lanes, g1: Vec3, g2: Vec3, g3: Vec3) -> Vec3:
    return Vec3(
        d1 * g1.x + d2 * g2.x + d3 * g3.x,
        d1 * g1.y + d2 * g2.y + d3 * g3.y,
        d1 * g1.z + d2 * g2.z + d3 * g3.z,
    )


@inlined
def _corners(solid: Solid, block: int, k: int) -> tuple[Lanes, Lanes, Lanes]:
    """Return the displacements of corner `k` of the tetrahedra of a block."""
    width = width_of(solid.shape)
    return points_of_rows(solid.displacement, solid.nodes, width * (4 * block + k))


@inlined
def shape_of(solid: Solid, block: int, which: int) -> Lanes:
    """Return a quantity of `Solid.shape` for the tetrahedra of a block."""
    return load_block(solid.shape, width_of(solid.shape) * (N_SHAPE * block + which))


@inlined
def gradient_of_shape(solid: Solid, block: int, first: int) -> Vec3:
    """Return the gradient of a shape function [1/m], which begins at that quantity of `shape`."""
    return Vec3(
        shape_of(solid, block, first),
        shape_of(solid, block, first + 1),
        shape_of(solid, block, first + 2),
    )
