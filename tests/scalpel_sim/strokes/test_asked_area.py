"""The area that a stroke is to cut is that of the section, in the body at rest."""

import math

import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.strokes.asked import asked_area, first_areas
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.strokes.kinds.incision import (
    DEPTH,
    INSERTED_AT,
    SLOPE,
    WITHDRAWN_AT,
)
from scalpel_sim.strokes.scene_stroke import stroke_through
from tests.support.planned_strokes import plan_incision, plan_stroke
from tissue import MATERIALS, Material, Snapshot, TetrahedralMesh, block

SLAB = block((4, 6, 4), (0.04, 0.06, 0.04))

NEAR = 0.01
"""Largest relative error: of places that are counted."""


def lying(mesh, positions=None):
    """Return a body that lies with its nodes elsewhere than at rest."""
    n = len(mesh.positions)
    positions = mesh.positions if positions is None else positions
    nothing = np.zeros((n, 3)), np.ones(n), np.zeros(n)
    labels = 0 * mesh.tetrahedra[:, 0]
    return Snapshot(positions, mesh.positions, *nothing, mesh.tetrahedra, np.zeros(n, bool), labels)


def planned(name, body, **settings):
    return plan_stroke(name, TetrahedralMesh(body.positions, body.tetrahedra), **settings)


@pytest.mark.parametrize("name", MATERIALS)
def test_the_area_of_a_straight_stroke_is_that_of_the_section(name):
    body = lying(SCENES[name].mesh())
    _, width, height = body.rest_positions.max(axis=0)
    section = width * height
    assert asked_area(planned("straight", body), body) == pytest.approx(section, rel=NEAR)


def test_a_slanted_section_is_larger():
    body = lying(SLAB)
    stroke = planned("slanted", body)
    lean = stroke.pose(0.0).tip - stroke.pose(0.0).heel
    wanted = 0.06 * 0.04 / math.cos(math.atan2(abs(lean[0]), math.hypot(lean[1], lean[2])))
    assert asked_area(stroke, body) == pytest.approx(wanted, rel=0.03)
    assert asked_area(stroke, body) > 1.02 * 0.06 * 0.04


def test_it_is_that_of_the_body_at_rest_and_not_as_it_lies():
    body = lying(SLAB, SLAB.positions * (1.1, 0.8, 0.9))
    assert asked_area(planned("straight", body), body) == pytest.approx(0.06 * 0.04, rel=NEAR)


def test_an_incision_asks_for_its_depth_over_its_length_and_not_for_what_it_is_drawn_on():
    body, length = lying(SLAB), (WITHDRAWN_AT - INSERTED_AT) * 0.06
    wanted = DEPTH * length + 0.5 * DEPTH**2 / math.tan(SLOPE)
    for drag in (0.0, 5e-3):
        stroke = plan_incision(SLAB, drag)
        assert asked_area(stroke, body) == pytest.approx(wanted, rel=NEAR)


def test_a_press_and_a_stop_do_not_say_and_a_miss_asks_for_nothing():
    body = lying(SLAB)
    assert asked_area(planned("press", body), body) is None
    assert asked_area(planned("stop", body), body) is None
    away = lying(SLAB, SLAB.positions + np.array([1.0, 0.0, 0.0]))
    assert asked_area(planned("straight", body), away) == 0.0


def along(x, depth, back=False):
    """An upright edge that is led through the slab at a place along x, so deep [m]."""
    points = [[x, -0.01, 0.04 - depth], [x, 0.07, 0.04 - depth]]
    return StrokeTable(kind="points", points=points[::-1] if back else points, length=0.06)


@pytest.mark.parametrize(
    ("second", "area"),
    [
        (along(0.021, 0.02), 0.0),  # the same again
        (along(0.021, 0.02, back=True), 0.0),
        (along(0.0215, 0.03), 0.06 * 0.01),  # deeper
        (along(0.031, 0.02), 0.06 * 0.02),  # beside it
    ],
)
def test_what_is_passed_twice_is_asked_for_once(second, area):
    body = lying(SLAB)
    stroke = stroke_through(SLAB, [along(0.021, 0.02), second], Material())
    near = 1e-3
    (_, one), (_, other) = first_areas(stroke, body, near)
    assert one == pytest.approx(0.06 * 0.02, rel=0.02)
    assert other == pytest.approx(area, abs=2 * near * 0.06)


@pytest.mark.parametrize("name", ["straight", "slanted", "curved", "incision"])
def test_a_single_stroke_asks_for_all_of_its_area_for_the_first_time(name):
    body = lying(SLAB)
    stroke = planned(name, body)
    ((_, area),) = first_areas(stroke, body, 3e-3)
    assert area == pytest.approx(asked_area(stroke, body), rel=1e-9)
