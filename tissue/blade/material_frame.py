"""Vectors of the deformed body, mapped to the body at rest."""

from tissue.blade.anchors import FREE, Anchors
from tissue.blade.edge import BladePose, sample_point
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, norm, scale, sub
from tissue.geometry.polar_decomposition import apply_transposed, nearest_rotation
from tissue.geometry.tetrahedron import (
    Matrix3,
    apply,
    determinant,
    edge_matrix,
    solve,
)
from tissue.mesh.body import Body

FLATTEST = 0.05
"""Determinant of the deformation gradient below which a tetrahedron is too flat to say which
direction is forward in the material; the vector is then left as it is."""

MOST_STRAIN = 2.0
"""Factor by which a length in the body at rest may differ from the length now. An element that is
about to be cut is stretched far more; without the bound the path of the cut would leap there."""


@kernel
def to_material(body: Body, t: int, direction: Vec3) -> Vec3:
    """Map a vector from the deformed body to the body at rest, in tetrahedron `t`."""
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
    """Return the rotation of the tissue along the edge, from the body at rest to the body now.

    It is the rotation of the mean deformation gradient of the tetrahedra that hold anchors. A
    single tetrahedron is dented and sheared by the blade, and says little of how the blade lies in
    the body.
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
    return nearest_rotation(Matrix3(c0, c1, c2))


@kernel
def rest_offset(pose: BladePose, rotation: Matrix3, n: int, k: int, beside: int) -> Vec3:
    """Return the vector from one sample of the edge to another, in the body at rest [m].

    Args:
        pose: Pose of the blade now.
        rotation: Rotation of the tissue (see `mean_rotation`).
        n: Number of samples.
        k: Sample at which the vector ends.
        beside: Sample at which it begins.
    """
    return apply_transposed(rotation, sub(sample_point(pose, k, n), sample_point(pose, beside, n)))
