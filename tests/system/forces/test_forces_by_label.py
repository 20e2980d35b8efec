"""Work of cutting and force on the edge in each label of a body."""

import numpy as np
import pytest

from tests.support import strokes
from tests.support.bodies import sides
from tests.system.forces.test_several_materials import BOTH, NO_GRAVITY, SIZE, SOFT, X, labelled
from tissue import BladeSegment, BladeShape, Snapshot, Tissue

DEPTHS = np.array([0.012, 0.008])
"""Depth of the two layers that are cut at once [m]."""

SHAPE = BladeShape(thickness=4e-4)


def drawn(tissue: Tissue, end: float = 0.044):
    """Draw an upright edge along y; return the results, and the place of each."""
    poses = strokes.upright(X, -0.004, end, -0.004, 0.026, speed=0.1)
    return strokes.make(tissue, poses), np.array([pose.tip[1] for pose in poses[1:]])


def layers(depth: float = DEPTHS[0], **options) -> Tissue:
    mesh = labelled(2, depth)
    return Tissue(mesh, BOTH, fixed=sides(mesh), gravity=NO_GRAVITY, **options)


def force_on_edge(result, forward) -> float:
    """Return the force against the motion of the edge, from contacts before the next step [N]."""
    contacts = result.contacts_of_blade
    at_edge = contacts.normal @ forward > 0.999
    return float(contacts.normal_force[at_edge].sum())


@pytest.mark.parametrize("depth", [0.005, 0.01, 0.015])
def test_the_force_in_each_layer_is_its_toughness_times_its_depth(depth):
    results, y = drawn(layers(depth))
    steady = [r.force_of_labels for r, at in zip(results, y, strict=True) if 0.015 < at < 0.03]
    expected = [20.0, 60.0] * np.array([depth, SIZE[2] - depth])
    np.testing.assert_allclose(np.mean(steady, axis=0), expected, rtol=0.05)


def cut_areas(before: Snapshot, after: Snapshot) -> np.ndarray:
    """Return the area of the faces of cuts of each of two labels, one side [m2]."""
    grown = np.zeros(2)
    for body, sign in ((before, -0.5), (after, 0.5)):
        corners = body.tetrahedra[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)
        faces, first, counts = np.unique(
            np.sort(corners, axis=1), axis=0, return_index=True, return_counts=True
        )
        a, b, c = body.rest_positions[faces[counts == 1]].transpose(1, 0, 2)
        areas = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
        labels = body.labels[first[counts == 1] // 4]
        grown += sign * np.bincount(labels, weights=areas, minlength=2)
    return grown


def test_the_work_in_each_layer_is_its_toughness_times_the_area_cut_of_it():
    """The border is jagged by a cell: labels are of whole tetrahedra."""
    tissue = layers()
    before = tissue.snapshot()
    work = drawn(tissue)[0][-1].cutting_of_labels
    areas = cut_areas(before, tissue.snapshot())
    np.testing.assert_allclose(areas, DEPTHS * SIZE[1], rtol=0.05)
    np.testing.assert_allclose(work, [20.0, 60.0] * areas, rtol=0.05)


@pytest.mark.parametrize("blade", [None, SHAPE], ids=["line", "scalpel"])
def test_labels_add_up_to_the_whole(blade):
    tissue, forces = layers(blade=blade), []
    for sweep in strokes.sweeps(strokes.upright(X, -0.004, 0.02, -0.004, 0.026, speed=0.1)):
        result = tissue.step(sweep, strokes.DT)
        assert result.cutting_of_labels.sum() == pytest.approx(result.work_of_cutting, rel=1e-12)
        forces.append(force_on_edge(result, strokes.Y))
        assert result.force_of_labels.sum() == pytest.approx(forces[-1], rel=1e-12, abs=1e-15)
    assert max(forces) > 0.5


def test_what_the_end_of_a_blade_pierces_is_of_its_label():
    mesh = labelled(2, DEPTHS[0])
    tissue = Tissue(mesh, BOTH, fixed=sides(mesh), gravity=NO_GRAVITY, blade=SHAPE)
    heights = np.linspace(0.021, 0.004, 171)
    at = [
        BladeSegment(np.array([X, 0.018, z]), np.array([X, 0.018, z + 0.02]), strokes.Y)
        for z in heights
    ]
    result = strokes.make(tissue, at)[-1]
    assert result.work_of_cutting > 0.0 and result.cutting_of_labels[1] > 0.0
    assert result.cutting_of_labels.sum() == pytest.approx(result.work_of_cutting, rel=1e-12)


def test_a_body_of_one_label_has_no_such_numbers():
    result = drawn(Tissue(labelled(2, 1.0), SOFT), end=0.004)[0][-1]
    assert result.work_of_cutting > 0.0
    assert len(result.cutting_of_labels) == len(result.force_of_labels) == 0


def test_they_are_of_labels_also_where_a_label_has_several_materials():
    tissue = layers()
    right = tissue.snapshot().positions[tissue.snapshot().tetrahedra].mean(axis=1)[:, 0] > 0.02
    tissue.set_material(right, young_modulus=1.5)
    results = drawn(tissue)[0]
    work = results[-1].cutting_of_labels
    assert len(work) == 2
    np.testing.assert_allclose(work, [20.0, 60.0] * DEPTHS * SIZE[1], rtol=0.05)


def test_states_carry_them_to_the_bit():
    tissue = layers()
    drawn(tissue, end=0.015)
    state = tissue.save_state().to_bytes()
    ends = []
    for _ in range(2):
        fresh = layers()
        fresh.load_state(type(tissue.save_state()).from_bytes(state))
        ends.append(drawn(fresh, end=0.01)[0][-1])
    one, other = ends
    assert one.cutting_of_labels.sum() == pytest.approx(one.work_of_cutting, rel=1e-12)
    assert one.cutting_of_labels.tobytes() == other.cutting_of_labels.tobytes()
    assert one.force_of_labels.tobytes() == other.force_of_labels.tobytes()
