"""Scenes judge the physics: the right theory passes, and a wrong one fails."""

import numpy as np
import pytest

from scalpel_sim.validate import audit, coupling, gel, puncture, reaction, slicing, steady, symmetry
from scalpel_sim.validate.block import COARSE, block_tissue, lead, rubber, through
from scalpel_sim.validate.findings import FAIL, PASS
from scalpel_sim.validate.scenes import SCENES, chosen
from tissue import Energies

TOUGHNESS = 20.0


def verdicts(lines):
    return {line.verdict for line in lines}


@pytest.fixture(scope="module")
def steady_cut():
    material = rubber(young_modulus=steady.STIFF_ENOUGH, toughness=TOUGHNESS)
    return steady.cut(material, COARSE, *steady.PLACES[1])


def test_a_steady_cut_passes_with_its_own_toughness(steady_cut):
    assert verdicts(steady.judge("it", [steady_cut], "neo_hookean", TOUGHNESS)) == {PASS}


@pytest.mark.parametrize("wrong", [0.9, 1.1])
def test_a_steady_cut_fails_with_a_toughness_ten_percent_off(steady_cut, wrong):
    force, ripple = steady.judge("it", [steady_cut], "neo_hookean", wrong * TOUGHNESS)
    assert force.verdict == FAIL and ripple.verdict == PASS


def test_a_force_that_ripples_fails(steady_cut):
    both = [steady_cut, steady_cut._replace(ripple=0.2)]  # the worst of them counts
    assert steady.judge("it", both, "neo_hookean", TOUGHNESS)[1].verdict == FAIL


def test_slicing_at_45_degrees_passes_and_would_fail_as_pressing():
    record = slicing.cut(1.0, slicing.FAST)
    assert verdicts(slicing.judge(1.0, slicing.FAST, record, slicing.TOUGHNESS)) == {PASS}
    assert verdicts(slicing.judge(0.0, slicing.FAST, record, slicing.TOUGHNESS)) == {FAIL}


def test_action_and_reaction_balance_and_a_force_from_nowhere_fails():
    found = reaction.cut("neo_hookean", 300)
    assert found.largest[0] > 0.01  # there is something to balance
    assert FAIL not in verdicts(reaction.judge("it", found))
    pushed = found._replace(momentum=found.momentum + 1e-8)
    assert FAIL in verdicts(reaction.judge("it", pushed))


def test_an_account_that_misses_six_thousandths_of_the_work_fails():
    nothing = dict.fromkeys(Energies._fields, 0.0)
    closed = Energies(**nothing | {"work_of_blade": 1.0, "cutting": 0.996})
    open_ = closed._replace(cutting=0.994)
    assert audit.judge("it", closed).verdict == PASS
    assert audit.judge("it", open_).verdict == FAIL


def test_strokes_of_the_audit_are_continuous():
    for stroke in audit.strokes(quick=False).values():
        tips = np.array([place.tip for place in stroke.places])
        assert np.linalg.norm(np.diff(tips, axis=0), axis=1).max() < 2e-4


def test_a_puncture_that_cuts_before_its_peak_or_is_too_weak_fails():
    found = puncture.Puncture(None, peak=0.06, plateau=0.02, after_peak=0.02, area_before=0.0)
    assert verdicts(puncture.judge_in("it", found, 0.06)) == {PASS}
    assert FAIL in verdicts(puncture.judge_in("it", found._replace(area_before=1e-9), 0.06))
    assert FAIL in verdicts(puncture.judge_in("it", found._replace(peak=0.05), 0.06))


def test_a_withdrawal_that_cuts_or_pushes_fails():
    found = puncture.Withdrawal(back=0.02, area=0.0, besides=0.01)
    assert verdicts(puncture.judge_out("it", found, 0.4)) == {PASS}
    for wrong in ({"back": -0.02}, {"area": 1e-9}, {"besides": 0.2}):
        assert FAIL in verdicts(puncture.judge_out("it", found._replace(**wrong), 0.4))


def test_a_coupling_that_makes_energy_fails():
    assert coupling.judge("taps", 10, -5e-7).verdict == PASS
    assert coupling.judge("taps", 10, -2e-6).verdict == FAIL


def test_the_toughness_of_gelatine_is_as_published():
    assert gel.published(1e-3 / 60.0) == 1.1
    assert gel.published(1.0 / 60.0) == pytest.approx(11.0)  # 1,000 mm/min: ten times the knee's


def test_a_mirrored_block_is_its_own_mirror_image():
    mesh = symmetry.mirrored(COARSE)
    turned = mesh.positions * (-1.0, 1.0, 1.0) + (0.04, 0.0, 0.0)
    here, there = ({tuple(p) for p in np.round(x, 8).tolist()} for x in (mesh.positions, turned))
    assert here == there
    assert len(mesh.tetrahedra) == 6 * 8 * 8 * 4


def test_an_edge_that_slices_is_in_with_its_whole_length_from_end_to_end():
    for place in (through(0.05, ratio=2.0)[0], through(0.05, ratio=2.0)[-1]):
        assert place.tip[2] < 0.0 and place.heel[2] > 0.02


def test_a_record_has_a_row_for_each_step():
    record = lead(block_tissue(rubber(), (2, 2, 1), audit=True), through(1.0))
    assert record.force.shape == record.tip.shape == (43, 3)
    assert record.accounts.shape == (43, len(Energies._fields))


def test_scenes_are_chosen_by_name_in_the_order_of_the_report():
    assert [scene.name for scene in chosen(["gel", "steady"])] == ["steady", "gel"]
    assert [scene.name for scene in chosen([])] == list(SCENES)
    for scene in SCENES.values():
        assert scene.about.endswith(".") and all(source.citation for source in scene.sources)
