"""Vectors of the deformed body, mapped to the body at rest."""

from tissue.blade.body_sheets import rotation_of_sheet, write_rotation
from tissue.blade.edge import BladePose, sample_point
from tissue.blade.edge_anchors import FREE, Anchors
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3, add, axpy, dot, norm, scale, sub, vec3
from tissue.geometry.polar_decomposition import apply_transposed
from tissue.geometry.tetrahedron import (
    Matrix3,
    apply,
    determinant,
    edge_matrix,
    solve,
)
from tissue.mesh.body import OUTER, Body, walk

FLATTEST = 0.05
"""Determinant of the deformation gradient below which a tetrahedron is too flat to say which
direction is forward in the material; the vector is then left as it is."""

MOST_STRAIN = 2.0
"""Factor by which a length in the body at rest may differ from the length now. An element that is
about to be cut is stretched far more; without the bound the path of the cut would leap there."""

BESIDE = 0.5
"""Distance on either side of an anchor within which the tissue shows how the cut turns, per
`BladeState.reach`: in the next tetrahedron or so. With 1 and 1.5 the force sideways on a blade is
as small, and that of a cut through eight cells of springs 1 % higher."""


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
def displacement_at_rest(
    anchors: Anchors, body: Body, k: int, displacement: Vec3, normal: Vec3, reach: float
) -> Vec3:
    """Map the displacement of anchor `k` to the body at rest [m].

    Sideways it is the mean of the tissue on both sides of the cut. Lips that a blade parts are
    sheared, one to each side. An anchor mostly is in one of them, and by that one alone would be
    led away from the cut, ever further: up to 0.6 mm in a block that is symmetric about it, where
    the force on the blade to that side was a third of that of the cut. Where the other lip has
    parted already, the displacement goes straight on. Where the body ends next to the cut, as in a
    thin sheet that folds, the anchor's own tetrahedron decides.

    Args:
        anchors: The samples, with their sheets.
        body: The tissue.
        k: The anchor.
        displacement: The displacement in the body as it is [m], in the plane of the blade.
        normal: Unit normal of that plane.
        reach: `BladeState.reach` [m].
    """
    t, at = anchors.tetrahedron[k], vec3(anchors.rest, k)
    sideways = apply_transposed(rotation_of_sheet(anchors.sheets, k), normal)
    here = to_material(body, t, displacement)
    right = walk(body, axpy(BESIDE * reach, sideways, at), t)
    left = walk(body, axpy(-BESIDE * reach, sideways, at), t)
    if right.link == OUTER or left.link == OUTER:
        return here
    drift = 0.0
    if right.inside and left.inside:
        drift = 0.5 * dot(
            add(
                to_material(body, right.tetrahedron, displacement),
                to_material(body, left.tetrahedron, displacement),
            ),
            sideways,
        )
    return axpy(drift - dot(here, sideways), sideways, here)


@kernel
def find_sheets(anchors: Anchors, body: Body, apart: float) -> None:
    """Find the sheets that the samples hold, and how each is turned.

    Samples that follow each other along the edge hold the same sheet unless their material points
    are far apart, or have a long gap between them. A single sample may be released for an instant;
    that does not part a sheet.

    Args:
        anchors: The samples; `sheets` is written.
        body: The tissue.
        apart: Length of a gap that parts two sheets, and by how much more than their samples two
            points of one sheet may be apart at rest [m].
    """
    sheets = anchors.sheets
    n = len(anchors.state)
    spacing = anchors.spacing
    before = -1
    for k in range(n):
        sheets.first[k] = -1
        if anchors.state[k] == FREE:
            continue
        sheets.first[k] = k
        if before >= 0:
            distance = norm(sub(vec3(anchors.rest, k), vec3(anchors.rest, before)))
            between = spacing * (k - before)
            if between - spacing <= apart and distance <= apart + between:
                sheets.first[k] = sheets.first[before]
            else:
                write_rotation(sheets, body, anchors.tetrahedron, sheets.first[before], k)
        before = k
    if before >= 0:
        write_rotation(sheets, body, anchors.tetrahedron, sheets.first[before], n)


@kernel
def rest_offset(pose: BladePose, rotation: Matrix3, n: int, k: int, adjacent: int) -> Vec3:
    """Return the vector from one sample of the edge to another, in the body at rest [m].

    Args:
        pose: Pose of the blade now.
        rotation: Rotation of the tissue there (see `find_sheets`).
        n: Number of samples.
        k: Sample at which the vector ends.
        adjacent: Sample at which it begins.
    """
    return apply_transposed(
        rotation, sub(sample_point(pose, k, n), sample_point(pose, adjacent, n))
    )
