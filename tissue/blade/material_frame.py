"""Vectors of the deformed body, mapped to the body at rest."""

from tissue.blade.anchors import FREE, Anchors
from tissue.blade.edge import BladePose, sample_point
from tissue.blade.walls import write_rotation
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, norm, scale, sub, vec3
from tissue.geometry.polar_decomposition import apply_transposed
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
def find_walls(anchors: Anchors, body: Body, apart: float) -> None:
    """Find the walls that the samples hold, and how each is turned.

    Samples that follow each other along the edge hold the same wall unless their material points
    are far apart, or there is a long gap between them. A single sample may let go for an instant;
    that does not part a wall.

    Args:
        anchors: The samples; `walls` is written.
        body: The tissue.
        apart: Length of a gap that parts two walls, and by how much more than their samples two
            points of one wall may be apart at rest [m].
    """
    walls = anchors.walls
    n = len(anchors.state)
    spacing = 2.0 * anchors.length[0]  # the first sample stands for half
    before = -1
    for k in range(n):
        walls.first[k] = -1
        if anchors.state[k] == FREE:
            continue
        walls.first[k] = k
        if before >= 0:
            distance = norm(sub(vec3(anchors.rest, k), vec3(anchors.rest, before)))
            between = spacing * (k - before)
            if between - spacing <= apart and distance <= apart + between:
                walls.first[k] = walls.first[before]
            else:
                write_rotation(walls, body, anchors.tetrahedron, walls.first[before], k)
        before = k
    if before >= 0:
        write_rotation(walls, body, anchors.tetrahedron, walls.first[before], n)


@kernel
def rest_offset(pose: BladePose, rotation: Matrix3, n: int, k: int, beside: int) -> Vec3:
    """Return the vector from one sample of the edge to another, in the body at rest [m].

    Args:
        pose: Pose of the blade now.
        rotation: Rotation of the tissue there (see `find_walls`).
        n: Number of samples.
        k: Sample at which the vector ends.
        beside: Sample at which it begins.
    """
    return apply_transposed(rotation, sub(sample_point(pose, k, n), sample_point(pose, beside, n)))
