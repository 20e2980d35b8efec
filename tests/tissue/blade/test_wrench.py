"""Wrench, stiffness and contacts at an instant: three descriptions of the same forces."""

import copy
import itertools

import numpy as np
import pytest

from tests.bridge.bits import bits
from tests.support.bodies import sides
from tissue import BladeSegment, BladeShape, BladeSweep, Material, Tissue, block

MESH = block((6, 6, 3), (0.04, 0.04, 0.02))
TOUGH = Material(toughness=20.0, blade_friction=0.3)
DT = 1e-3
NO_GRAVITY = (0.0, 0.0, 0.0)


def edge_at(y, x=0.0201, turned=0.0):
    tip = np.array([x, y, -0.005])
    return BladeSegment(
        tip, tip + np.array([0.0, 0.0, 0.03]), np.array([np.sin(turned), np.cos(turned), 0.0])
    )


def cut_to(y, material=TOUGH, blade=BladeShape()):
    """Return a tissue cut from y = 0 to `y` [m], the last result and the last pose of the edge."""
    tissue = Tissue(MESH, material, fixed=sides(MESH), gravity=NO_GRAVITY, blade=blade)
    poses = [edge_at(at) for at in np.arange(-0.002, y, 1e-4)]
    for a, b in itertools.pairwise(poses):
        result = tissue.step(BladeSweep(a, b), DT)
    return tissue, result, poses[-1]


@pytest.fixture(scope="module")
def cut():
    return cut_to(0.02)


def test_the_contacts_add_up_to_the_wrench(cut):
    _, result, _ = cut
    contacts, wrench = result.contacts, result.wrench_t1
    forces = contacts.normal * contacts.normal_force[:, None] + contacts.friction
    np.testing.assert_allclose(forces.sum(axis=0), -wrench.force, atol=1e-12)
    assert (contacts.normal_force >= 0.0).all()
    np.testing.assert_allclose(np.linalg.norm(contacts.normal, axis=1), 1.0, rtol=1e-12)


def test_the_cut_areas_of_the_contacts_add_up_to_that_of_the_step():
    tissue, result, pose = cut_to(0.015)
    poses = [edge_at(pose.tip[1] + i * 1e-4) for i in range(101)]
    areas, works = [], [result.work_of_cutting]
    for a, b in itertools.pairwise(poses):
        result = tissue.step(BladeSweep(a, b), DT)
        areas.append(result.contacts.cut_area.sum())
        works.append(result.work_of_cutting)
    np.testing.assert_allclose(np.array(areas) * TOUGH.toughness, np.diff(works), rtol=1e-9)
    assert sum(areas) == pytest.approx(0.01 * 0.02, rel=0.1)  # the lips spring forward


def test_contacts_are_views_without_a_copy(cut):
    _, result, _ = cut
    numbers = result.contacts._replace(geom=result.contacts.point)
    assert all(view.base is not None for view in numbers)
    assert (result.contacts.geom == -1).all()


def test_stiffness_is_symmetric_and_positive(cut):
    _, result, _ = cut
    np.testing.assert_array_equal(result.stiffness, result.stiffness.T)
    values = np.linalg.eigvalsh(result.stiffness)
    assert values[0] > -1e-9 * values.sum()
    assert values[-1] > 100.0  # a scalpel in tissue: N/m


@pytest.mark.parametrize("blade", [None, BladeShape()])
@pytest.mark.parametrize("axis", [0, 2])
def test_stiffness_is_the_derivative_of_the_force_before_the_tissue_moves(blade, axis):
    """A shift by a micrometre sideways or along the edge, in 0.1 us: the tissue does not move."""
    forces = []
    for distance in (0.0, 1e-6):
        tissue, result, pose = cut_to(0.01, Material(toughness=2000.0), blade)
        shift = distance * np.eye(3)[axis]
        moved = pose._replace(tip=pose.tip + shift, heel=pose.heel + shift)
        forces.append(tissue.step(BladeSweep(pose, moved), 1e-7).wrench_t1.force)
    change = (forces[1] - forces[0]) / 1e-6
    np.testing.assert_allclose(change, -result.stiffness[:3, axis], rtol=0.02, atol=5.0)


SIDE = 0.02


def edge(y):
    ends = np.array([[SIDE / 2.0, y, -SIDE], [SIDE / 2.0, y, 2.0 * SIDE]])
    return BladeSegment(*ends, np.array([0.0, 1.0, 0.0]))


def steps(n):
    """Return results of a blade that enters a block, and copies of them made at once."""
    tissue = Tissue(block((2, 2, 2), (SIDE,) * 3), blade=BladeShape())
    results, copies = [], []
    for i in range(n):
        sweep = BladeSweep(edge(-0.002 + 5e-4 * i), edge(-0.002 + 5e-4 * (i + 1)))
        results.append(tissue.step(sweep, 1e-3))
        copies.append(copy.deepcopy(results[-1]))
    return results, copies


@pytest.fixture(scope="module")
def result():
    results, _ = steps(12)
    assert results[-1].anchored_length > 0.0 and results[-1].wrench.force.any()
    return results[-1]


def test_later_steps_change_nothing_but_the_views_of_contacts():
    results, copies = steps(12)
    for result, copied in zip(results, copies, strict=True):
        assert bits(result._replace(contacts=None)) == bits(copied._replace(contacts=None))
    assert bits(results[-1].contacts) == bits(copies[-1].contacts)
