"""A block that is rounded to a lobe: where its surface is, and how good its elements are."""

import numpy as np
import pytest

from scalpel_sim.meshing.graded import DOMED, graded_block, lobe

ALONG = ([7e-3, *[5e-3] * 9, 7e-3], [8e-3, *[5e-3] * 4, 8e-3], [5e-3] * 3)
"""Sizes of cells as of a task [m]."""


def smallest_altitude(mesh):
    corners = mesh.positions[mesh.tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    assert (volumes > 0.0).all()
    faces = corners[:, [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]]
    sides = np.cross(faces[:, :, 1] - faces[:, :, 0], faces[:, :, 2] - faces[:, :, 0])
    return (3.0 * volumes / (0.5 * np.linalg.norm(sides, axis=2).max(axis=1))).min()


def test_a_lobe_lies_flat_and_is_highest_in_its_middle():
    plain, found = graded_block(*ALONG).positions, lobe(*ALONG).positions
    is_below, is_above = plain[:, 2] == 0.0, plain[:, 2] == plain[:, 2].max()
    assert (found[is_below, 2] == 0.0).all()
    middle = np.linalg.norm(found[is_above, :2] - 0.5 * plain.max(axis=0)[:2], axis=1).argmin()
    assert found[is_above, 2].max() == found[is_above, 2][middle]
    assert found[is_above, 2].min() == pytest.approx((1.0 - 2.0 * DOMED) * plain[:, 2].max())


def test_no_element_of_a_lobe_is_thin():
    plain, found = (smallest_altitude(make(*ALONG)) for make in (graded_block, lobe))
    assert found > 0.35 * plain
