"""Scenes judge the physics: the right theory passes, and a wrong one fails."""

import re

import numpy as np
import pytest

from scalpel_sim.validate.audit import audit_strokes, check_residual
from scalpel_sim.validate.block import (
    COARSE_CELLS,
    block_tissue,
    run_stroke,
    soft_material,
    straight_cut,
)
from scalpel_sim.validate.coupling import check_least_energy
from scalpel_sim.validate.findings import FAIL, PASS
from scalpel_sim.validate.gel import published_toughness
from scalpel_sim.validate.puncture import (
    InsertionForces,
    WithdrawalForces,
    check_insertion,
    check_withdrawal,
)
from scalpel_sim.validate.reaction import check_balance, cut_free_block
from scalpel_sim.validate.scenes import VALIDATION_SCENES, chosen_scenes
from scalpel_sim.validate.slicing import (
    SLICING_SPEED,
    SLICING_TOUGHNESS,
    check_slicing,
    cut_by_slicing,
)
from scalpel_sim.validate.steady import (
    STEADY_CELLS,
    STEADY_CUTS,
    check_steady_cuts,
    cut_steadily,
    steady_material,
)
from scalpel_sim.validate.symmetry import mirrored_block
from tissue import Energies

TOUGHNESS = 20.0


def verdicts(checks):
    return {check.verdict for check in checks}


@pytest.mark.parametrize("scene", VALIDATION_SCENES.values(), ids=VALIDATION_SCENES)
def test_every_scene_says_which_stiffness_it_takes(scene):
    assert re.search(r"\d [kM]Pa", scene.about)


@pytest.fixture(scope="module")
def steady_cut():
    material = steady_material("neo_hookean", TOUGHNESS)
    return cut_steadily(material, STEADY_CELLS[0], *STEADY_CUTS[1])


def test_a_steady_cut_passes_with_its_own_toughness(steady_cut):
    assert verdicts(check_steady_cuts("it", [steady_cut], TOUGHNESS)) == {PASS}


@pytest.mark.parametrize("wrong", [0.9, 1.1])
def test_a_steady_cut_fails_with_a_toughness_ten_percent_off(steady_cut, wrong):
    force, *others = check_steady_cuts("it", [steady_cut], wrong * TOUGHNESS)
    assert force.verdict == FAIL and verdicts(others) == {PASS}


@pytest.mark.parametrize(("fault", "row"), [({"ripple": 0.2}, 1), ({"lowest": 0.8}, 2)])
def test_a_force_that_ripples_or_dips_fails(steady_cut, fault, row):
    both = [steady_cut, steady_cut._replace(**fault)]  # the worst of them counts
    assert check_steady_cuts("it", both, TOUGHNESS)[row].verdict == FAIL


def test_slicing_at_45_degrees_passes_and_would_fail_as_pressing():
    cut = [cut_by_slicing(1.0, SLICING_SPEED)]
    assert verdicts(check_slicing(1.0, SLICING_SPEED, cut, SLICING_TOUGHNESS)) == {PASS}
    assert verdicts(check_slicing(0.0, SLICING_SPEED, cut, SLICING_TOUGHNESS)) == {FAIL}


def test_action_and_reaction_balance_and_a_force_from_nowhere_fails():
    found = cut_free_block("neo_hookean", 300)
    assert found.largest[0] > 0.01  # there is something to balance
    assert FAIL not in verdicts(check_balance("it", found))
    pushed = found._replace(momentum=found.momentum + 1e-8)
    assert FAIL in verdicts(check_balance("it", pushed))


def test_an_account_that_misses_six_thousandths_of_the_work_fails():
    nothing = dict.fromkeys(Energies._fields, 0.0)
    closed = Energies(**nothing | {"work_of_blade": 1.0, "cutting": 0.996})
    unclosed = closed._replace(cutting=0.994)
    assert check_residual("it", closed).verdict == PASS
    assert check_residual("it", unclosed).verdict == FAIL


def test_strokes_of_the_audit_are_continuous():
    for stroke in audit_strokes(quick=False).values():
        tips = np.array([pose.tip for pose in stroke.poses])
        assert np.linalg.norm(np.diff(tips, axis=0), axis=1).max() < 2e-4


def test_a_puncture_that_cuts_before_its_peak_or_is_too_weak_fails():
    found = InsertionForces(None, peak=0.06, plateau=0.02, after_peak=0.02, area_before=0.0)
    assert verdicts(check_insertion("it", found, 0.06)) == {PASS}
    assert FAIL in verdicts(check_insertion("it", found._replace(area_before=1e-9), 0.06))
    assert FAIL in verdicts(check_insertion("it", found._replace(peak=0.05), 0.06))


def test_a_withdrawal_that_cuts_or_pushes_fails():
    found = WithdrawalForces(resistance=0.02, area=0.0, excess_work=0.01)
    assert verdicts(check_withdrawal("it", found, 0.4)) == {PASS}
    for wrong in ({"resistance": -0.02}, {"area": 1e-9}, {"excess_work": 0.2}):
        assert FAIL in verdicts(check_withdrawal("it", found._replace(**wrong), 0.4))


def test_a_coupling_that_generates_energy_fails():
    assert check_least_energy("taps", 10, -5e-7).verdict == PASS
    assert check_least_energy("taps", 10, -2e-6).verdict == FAIL


def test_the_toughness_of_gelatine_is_as_published():
    assert published_toughness(1e-3 / 60.0) == 1.1
    assert published_toughness(1.0 / 60.0) == pytest.approx(
        11.0
    )  # 1,000 mm/min: ten times the knee's


def test_a_mirrored_block_is_its_own_mirror_image():
    mesh = mirrored_block(COARSE_CELLS)
    turned = mesh.positions * (-1.0, 1.0, 1.0) + (0.04, 0.0, 0.0)
    here, there = ({tuple(p) for p in np.round(x, 8).tolist()} for x in (mesh.positions, turned))
    assert here == there
    assert len(mesh.tetrahedra) == 6 * 8 * 8 * 4


def test_an_edge_that_slices_spans_the_body_from_the_first_pose_to_the_last():
    poses = straight_cut(0.05, ratio=2.0)
    for pose in (poses[0], poses[-1]):
        assert pose.tip[2] < 0.0 and pose.heel[2] > 0.02


def test_a_record_has_a_row_for_each_step():
    record = run_stroke(block_tissue(soft_material(), (2, 2, 1), audit=True), straight_cut(1.0))
    assert record.force.shape == record.tip.shape == (43, 3)
    assert record.energy_rows.shape == (43, len(Energies._fields))


def test_scenes_are_chosen_by_name_in_the_order_of_the_report():
    assert [scene.name for scene in chosen_scenes(["gel", "steady"])] == ["steady", "gel"]
    assert [scene.name for scene in chosen_scenes([])] == list(VALIDATION_SCENES)
    for scene in VALIDATION_SCENES.values():
        assert scene.about.endswith(".") and all(each.citation for each in scene.references)
