"""Stress and stiffness of the laws of tetrahedra, from rows of H = F - 1."""

from tissue.core.jit import inlined
from tissue.core.simd import Lanes
from tissue.core.simd_blocks import splat
from tissue.core.vec3 import Vec3, cross, dot
from tissue.laws.kernels import LawOfBlock, stiffening_slope

MatrixRows = tuple[Vec3, Vec3, Vec3]
"""Rows of a matrix of each lane of a vector."""


@inlined
def cofactors_of(x: Vec3, y: Vec3, z: Vec3) -> MatrixRows:
    """Return the rows of cof H from the rows of H."""
    return cross(y, z), cross(z, x), cross(x, y)


@inlined
def deformed_cofactors(x: Vec3, y: Vec3, z: Vec3) -> MatrixRows:
    """Return the rows of cof F from the rows of H."""
    one = splat(1.0, x.x)
    f1, f2, f3 = Vec3(x.x + one, x.y, x.z), Vec3(y.x, y.y + one, y.z), Vec3(z.x, z.y, z.z + one)
    return cofactors_of(f1, f2, f3)


@inlined
def product_with(rows: MatrixRows, v: Vec3) -> Vec3:
    """Return the product of a matrix with a vector."""
    x, y, z = rows
    return Vec3(dot(x, v), dot(y, v), dot(z, v))


@inlined
def stress_of(
    a: Lanes, b: Lanes, c: Lanes, gradient: MatrixRows, cofactors: MatrixRows
) -> MatrixRows:
    """Return the rows of a H + b K + c, K = (tr H) 1 - H^T + cof H.

    Args:
        a: Factor of H.
        b: Factor of K.
        c: Factor of 1.
        gradient: Rows of H.
        cofactors: Rows of cof H.
    """
    x, y, z = gradient
    cx, cy, cz = cofactors
    trace = x.x + y.y + z.z
    return (
        Vec3(
            a * x.x + b * (trace - x.x + cx.x) + c,
            a * x.y + b * (cx.y - y.x),
            a * x.z + b * (cx.z - z.x),
        ),
        Vec3(
            a * y.x + b * (cy.x - x.y),
            a * y.y + b * (trace - y.y + cy.y) + c,
            a * y.z + b * (cy.z - z.y),
        ),
        Vec3(
            a * z.x + b * (cz.x - x.z),
            a * z.y + b * (cz.y - y.z),
            a * z.z + b * (trace - z.z + cz.z) + c,
        ),
    )


@inlined
def shear_stiffness(
    law: LawOfBlock, q: Lanes, g: Lanes, gradient: MatrixRows, cofactors: MatrixRows
) -> tuple[Lanes, Lanes]:
    """Return a bound on the stiffness of the shear over that at rest, and g' = w''(q).

    A node that moves by u changes F by u times grad N. The second derivative of J by that is 0, and
    that of the energy is mu (g |dF|^2 + 2 g' ((F - cof F) : dF)^2).

    Args:
        law: A law that stiffens, of the block.
        q: Its argument (`tissue.laws.kernels`).
        g: w'(q).
        gradient: Rows of H.
        cofactors: Rows of cof H.
    """
    x, y, z = gradient
    cx, cy, cz = cofactors
    trace = x.x + y.y + z.z
    two = splat(2.0, trace)
    # The rows of H - K, K = (tr H) 1 - H^T + cof H:
    ax = Vec3(two * x.x - trace - cx.x, x.y + y.x - cx.y, x.z + z.x - cx.z)
    ay = Vec3(y.x + x.y - cy.x, two * y.y - trace - cy.y, y.z + z.y - cy.z)
    az = Vec3(z.x + x.z - cz.x, z.y + y.z - cz.y, two * z.z - trace - cz.z)
    squared = dot(ax, ax) + dot(ay, ay) + dot(az, az)
    slope = stiffening_slope(law, q, g)
    return g + (slope + slope) * squared, slope
