"""The sheets that the edge is in: runs of samples that hold the same part of the tissue.

In a thin or hollow body the edge is in tissue in several places at once, and these may be turned
against each other by a right angle. What is true of one says nothing of another.
"""

import numpy as np

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3, add
from tissue.geometry.polar_decomposition import nearest_rotation
from tissue.geometry.tetrahedron import (
    Matrix3,
    apply,
    edge_matrix,
    solve,
)
from tissue.mesh.body import Body


class BodySheets(Arrays):
    """The sheet that each of the n samples of the edge holds."""

    first: IntArray
    """First sample of the sheet, the number of the sheet; -1 where a sample holds none; (n,)."""
    rotation: FloatArray
    """Rotation of the sheet from the body at rest to the body now, column by column; (n, 9)."""
    has_begun: BoolArray
    """Whether an anchor in the sheet has cut, entry `first`; shape (n,)."""
    is_cut: BoolArray
    """Whether an anchor in the sheet pulls, or left it in this step, entry `first`; shape (n,).
    From the others the blade has backed off."""
    has_left: BoolArray
    """Whether all samples left the sheet in this step, entry `first`; shape (n,)."""


def new_body_sheets(n: int) -> BodySheets:
    """Return the sheets of `n` samples that hold nothing."""
    return BodySheets(
        first=np.full(n, -1, np.int64),
        rotation=np.tile(np.eye(3).ravel(), (n, 1)),
        has_begun=np.zeros(n, np.bool_),
        is_cut=np.zeros(n, np.bool_),
        has_left=np.zeros(n, np.bool_),
    )


@kernel
def rotation_of_sheet(sheets: BodySheets, k: int) -> Matrix3:
    """Return the rotation of the sheet that sample `k` holds."""
    r = sheets.rotation
    return Matrix3(
        Vec3(r[k, 0], r[k, 1], r[k, 2]),
        Vec3(r[k, 3], r[k, 4], r[k, 5]),
        Vec3(r[k, 6], r[k, 7], r[k, 8]),
    )


@kernel
def join_sheet(sheets: BodySheets, k: int, adjacent: int) -> None:
    """Put sample `k`, which holds or is placed with it, in the sheet of sample `adjacent`."""
    sheets.first[k] = sheets.first[adjacent]
    for i in range(9):
        sheets.rotation[k, i] = sheets.rotation[adjacent, i]


@kernel
def write_rotation(
    sheets: BodySheets, body: Body, tetrahedra: IntArray, first: int, end: int
) -> None:
    """Write the rotation of the samples from `first` to before `end` that hold tissue.

    It is that of the mean deformation gradient of the tetrahedra that hold them. A single
    tetrahedron is dented and sheared by the blade, and says little of how the blade lies in the
    body.

    Args:
        sheets: `first` is read, `rotation` is written.
        body: The tissue.
        tetrahedra: Tetrahedron that holds each sample.
        first: First sample of the sheet.
        end: One past the last sample.
    """
    c0 = Vec3(0.0, 0.0, 0.0)
    c1 = Vec3(0.0, 0.0, 0.0)
    c2 = Vec3(0.0, 0.0, 0.0)
    gradient, before = Matrix3(c0, c1, c2), -1
    for k in range(first, end):
        if sheets.first[k] == first:
            t = tetrahedra[k]
            if t != before:  # several samples in turn are in the same one
                gradient, before = _gradient(body, t), t
            c0, c1, c2 = add(c0, gradient.c0), add(c1, gradient.c1), add(c2, gradient.c2)
    r = nearest_rotation(Matrix3(c0, c1, c2))
    for k in range(first, end):
        if sheets.first[k] == first:
            for column in range(3):
                c = r.c0 if column == 0 else (r.c1 if column == 1 else r.c2)
                sheets.rotation[k, 3 * column] = c.x
                sheets.rotation[k, 3 * column + 1] = c.y
                sheets.rotation[k, 3 * column + 2] = c.z


@kernel
def _gradient(body: Body, t: int) -> Matrix3:
    """Return the deformation gradient of tetrahedron `t`."""
    now = edge_matrix(body.positions, body.tetrahedra, t)
    rest = edge_matrix(body.rest, body.tetrahedra, t)
    return Matrix3(
        apply(now, solve(rest, Vec3(1.0, 0.0, 0.0))),
        apply(now, solve(rest, Vec3(0.0, 1.0, 0.0))),
        apply(now, solve(rest, Vec3(0.0, 0.0, 1.0))),
    )
