"""The incision in liver: the right one passes, and each fault fails its own check."""

import numpy as np
import pytest

from scalpel_sim.scene.read import SCENES
from scalpel_sim.strokes.kinds.incision import DEPTH
from scalpel_sim.validate.findings import FAIL, PASS
from scalpel_sim.validate.incision import DrawnIncision, check_incision, check_meshes, rest_of
from tissue import Snapshot, block

TRAVEL = np.linspace(0.0, 0.05, 501)
FIRST = 7e-3


def incision(first=FIRST, ahead=6e-3, grows=0.0, force=1.0, paid=1.0, opened=1.0):
    """Return an incision that cuts at toughness times depth after `first` of travel [m]."""
    n = len(TRAVEL)
    area = DEPTH * np.maximum(TRAVEL - first, 0.0)
    asked = area[-1] / 0.99
    return DrawnIncision(
        travel=TRAVEL,
        force=np.full(n, force * SCENES["incision"].material.toughness * DEPTH),
        ahead=ahead + grows * TRAVEL,
        paid=area,
        opened=area,
        asked=asked,
        paid_at_end=paid * opened * asked,
        opened_at_end=opened * asked,
    )


def test_an_incision_as_theory_says_passes():
    assert {check.verdict for check in check_incision("it", incision())} == {PASS}


@pytest.mark.parametrize(
    ("fault", "row"),
    [
        ({"first": 4e-3}, 0),
        ({"first": 11e-3}, 0),
        ({"grows": 0.05}, 1),
        ({"force": 1.09}, 2),
        ({"paid": 0.94}, 3),
        ({"opened": 1.06}, 4),
    ],
)
def test_each_fault_of_an_incision_fails(fault, row):
    verdicts = [check.verdict for check in check_incision("it", incision(**fault))]
    assert verdicts.pop(row) == FAIL
    assert set(verdicts) == {PASS}


def test_a_blade_that_cuts_nothing_has_no_first_cut():
    assert incision(first=1.0).first_cut == np.inf


def test_a_length_that_is_not_known_in_each_frame_is_averaged_over_those_where_it_is():
    found = incision()
    found.ahead[1::10] = np.nan
    assert found.steady_ahead == pytest.approx(6e-3)


@pytest.mark.parametrize(("fault", "row"), [({"ahead": 6.6e-3}, 1), ({"force": 1.1}, 2)])
def test_meshes_that_differ_fail(fault, row):
    checks = check_meshes(incision(), incision(**fault))
    assert [check.verdict for check in checks].index(FAIL) == row


def test_material_is_found_where_it_is_at_rest_in_a_body_that_is_sheared():
    mesh = block((2, 2, 2), (1.0, 1.0, 1.0))
    rest = mesh.positions
    still, light = np.zeros_like(rest), np.ones(len(rest))
    own, added, free = light, 0.0 * light, light > 2
    moved = rest + 0.3 * rest[:, [2, 0, 1]]
    body = Snapshot(
        moved, rest, still, own, added, mesh.tetrahedra, free, 0 * mesh.tetrahedra[:, 0]
    )
    points = np.random.default_rng(0).uniform(0.1, 0.9, (20, 3))
    moved = points + 0.3 * points[:, [2, 0, 1]]
    np.testing.assert_allclose(rest_of(moved, body), points, atol=1e-12)
    assert np.isnan(rest_of(np.array([[5.0, 0.0, 0.0]]), body)).all()
