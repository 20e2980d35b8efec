"""Between the body as it is and the body at rest: vectors, and the rotation along the edge."""

from tissue.blade.anchors import FREE, Anchors
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, cross, dot, norm, scale
from tissue.geometry.tetrahedron import (
    Matrix3,
    apply,
    determinant,
    edge_matrix,
    solve,
)
from tissue.mesh.body import Body

FLATTEST = 0.05
"""Determinant of the deformation gradient below which a tetrahedron is too squashed to say which
way is forward in the material; the current direction is taken instead."""

MOST_STRAIN = 2.0
"""Factor by which a length in the body at rest may differ from the length now. Tissue about to part
is stretched far more over an element; without the bound the path of the cut would leap there."""

POLAR_ITERATIONS = 8
"""Steps of the iteration for the rotation in a deformation; it doubles the digits in each."""

IDENTITY = Matrix3(Vec3(1.0, 0.0, 0.0), Vec3(0.0, 1.0, 0.0), Vec3(0.0, 0.0, 1.0))


@kernel
def to_material(body: Body, t: int, direction: Vec3) -> Vec3:
    """Map a vector from the body as it is to the body at rest, in tetrahedron `t`."""
    now = edge_matrix(body.positions, body.tetrahedra, t)
    rest = edge_matrix(body.rest, body.tetrahedra, t)
    if determinant(now) < FLATTEST * determinant(rest):
        return direction
    mapped = apply(rest, solve(now, direction))
    length = norm(mapped)
    if length == 0.0:
        return direction
    wanted = norm(direction)
    return scale(min(max(length, wanted / MOST_STRAIN), wanted * MOST_STRAIN) / length, mapped)


@kernel
def mean_rotation(anchors: Anchors, body: Body) -> Matrix3:
    """The rotation of the tissue along the edge, from the body at rest to the body as it is.

    It is that of the mean deformation gradient of the tetrahedra that the edge holds. A single one
    is dented and sheared by the blade, and says little of how the blade lies to the body.
    """
    c0 = Vec3(0.0, 0.0, 0.0)
    c1 = Vec3(0.0, 0.0, 0.0)
    c2 = Vec3(0.0, 0.0, 0.0)
    for k in range(len(anchors.state)):
        if anchors.state[k] != FREE:
            t = anchors.tetrahedron[k]
            now = edge_matrix(body.positions, body.tetrahedra, t)
            rest = edge_matrix(body.rest, body.tetrahedra, t)
            c0 = add(c0, apply(now, solve(rest, Vec3(1.0, 0.0, 0.0))))
            c1 = add(c1, apply(now, solve(rest, Vec3(0.0, 1.0, 0.0))))
            c2 = add(c2, apply(now, solve(rest, Vec3(0.0, 0.0, 1.0))))
    return rotation_of(Matrix3(c0, c1, c2))


@kernel
def rotation_of(m: Matrix3) -> Matrix3:
    """The rotation nearest to `m`, up to scale; the identity where `m` is not near any.

    Higham's iteration for the polar decomposition: R <- (R + R^-T) / 2.
    """
    size = norm(m.c0) + norm(m.c1) + norm(m.c2)
    if size == 0.0:
        return IDENTITY
    r = Matrix3(scale(3.0 / size, m.c0), scale(3.0 / size, m.c1), scale(3.0 / size, m.c2))
    for _ in range(POLAR_ITERATIONS):
        d = determinant(r)
        if d < FLATTEST:
            return IDENTITY
        half = 0.5 / d  # the columns of R^-T are cross products of those of R, over det R
        r = Matrix3(
            add(scale(0.5, r.c0), scale(half, cross(r.c1, r.c2))),
            add(scale(0.5, r.c1), scale(half, cross(r.c2, r.c0))),
            add(scale(0.5, r.c2), scale(half, cross(r.c0, r.c1))),
        )
    return r


@kernel
def turned_back(rotation: Matrix3, v: Vec3) -> Vec3:
    """Return R^T v."""
    return Vec3(dot(rotation.c0, v), dot(rotation.c1, v), dot(rotation.c2, v))
