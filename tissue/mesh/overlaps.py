"""Whether two bodies lie in each other, deeper than where they touch."""

import itertools
from collections.abc import Iterator

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.geometry.tetrahedron_overlap import overlap_depths
from tissue.mesh.mesh_arrays import MeshError
from tissue.types import TetrahedralMesh

TOUCHING = 1e-3
"""Depth to which two bodies may lie in each other where they touch, in sizes of the smaller of two
tetrahedra, the cube root of its volume: contact presses that out. Ten times as much, and bodies of
which all nodes of one lie in the other pass through each other."""

_AT_A_TIME = 250
"""Tetrahedra whose neighbours are looked up at once: some 10 MB."""


def expect_apart(names: tuple[str, str], one: TetrahedralMesh, other: TetrahedralMesh) -> None:
    """Refuse two bodies that overlap.

    Args:
        names: Names of both.
        one: The one.
        other: The other.

    Raises:
        MeshError: they overlap.
    """
    mine, theirs = (mesh.positions[mesh.tetrahedra] for mesh in (one, other))
    mine, theirs = _near(mine, theirs), _near(theirs, mine)
    for pairs in _near_pairs(mine, theirs):
        a, b = mine[pairs[:, 0]], theirs[pairs[:, 1]]
        depths = overlap_depths(a, b)
        depths[depths <= TOUCHING * np.minimum(_sizes(a), _sizes(b))] = 0.0
        k = int(depths.argmax())
        if depths[k] > 0.0:
            low = np.maximum(a[k].min(axis=0), b[k].min(axis=0))
            high = np.minimum(a[k].max(axis=0), b[k].max(axis=0))
            x, y, z = 0.5 * (low + high)
            raise MeshError(
                f"bodies '{names[0]}' and '{names[1]}' overlap, by {1e3 * depths[k]:.2g} mm or "
                f"more, near ({x:.4g}, {y:.4g}, {z:.4g}) m: move one of them until they only "
                "touch, or cut the shape of one out of the other"
            )


def _near(corners: FloatArray, others: FloatArray) -> FloatArray:
    """Return the tetrahedra that reach into the box around others, shape (n, 4, 3)."""
    low, high = others.min(axis=(0, 1)), others.max(axis=(0, 1))
    inside = (corners.max(axis=1) >= low).all(axis=1) & (corners.min(axis=1) <= high).all(axis=1)
    return np.asarray(corners[inside])


def _near_pairs(ones: FloatArray, others: FloatArray) -> Iterator[IntArray]:
    """Yield pairs of tetrahedra of which the boxes meet, some at a time, each (n, 2)."""
    from scipy.spatial import cKDTree  # 0.2 s, and only here

    if not (len(ones) and len(others)):
        return
    centres, radii = _spheres(others)
    tree = cKDTree(centres)
    for begin in range(0, len(ones), _AT_A_TIME):
        some = ones[begin : begin + _AT_A_TIME]
        middles, own = _spheres(some)
        near = tree.query_ball_point(middles, own + radii.max())
        first = np.repeat(np.arange(len(some)), [len(found) for found in near])
        second = np.array(list(itertools.chain.from_iterable(near)), np.int64)
        a, b = some[first], others[second]
        meet = (a.max(axis=1) >= b.min(axis=1)).all(axis=1)
        meet &= (a.min(axis=1) <= b.max(axis=1)).all(axis=1)
        if meet.any():
            yield np.stack([begin + first[meet], second[meet]], axis=1)


def _spheres(corners: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return middles of tetrahedra [m], shape (n, 3), and how far corners are from them, (n,)."""
    middles = corners.mean(axis=1)
    return middles, np.linalg.norm(corners - middles[:, None], axis=2).max(axis=1)


def _sizes(corners: FloatArray) -> FloatArray:
    """Return the sizes of tetrahedra, the cube roots of their volumes [m], shape (n,)."""
    volumes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    return np.asarray(np.cbrt(volumes))
