"""The pieces that a stroke is to leave are those that its sheet parts the body in."""

import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.strokes.asked import asked_pieces
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.strokes.scene_stroke import stroke_through
from tests.scalpel_sim.strokes.test_asked_area import lying
from tests.support.planned_strokes import plan_stroke
from tissue import Material, TetrahedralMesh, block

SIZE = np.array([0.04, 0.06, 0.04])
SLAB = block((4, 6, 4), SIZE)
NODE_SIZE = 0.007


def along_y(x, low=-0.005, end=0.07):
    points = [[x, -0.01, low], [x, end, low]]
    return StrokeTable(kind="points", points=points, length=0.06)


def along_x(y):
    points = [[-0.01, y, -0.005], [0.05, y, -0.005]]
    return StrokeTable(kind="points", points=points, length=0.06)


def pieces(*tables, mesh=SLAB):
    stroke = stroke_through(mesh, tables, Material())
    return asked_pieces(stroke, lying(mesh), NODE_SIZE)


@pytest.mark.parametrize("name", ["straight", "slanted", "curved"])
@pytest.mark.parametrize("scene", ["slab", "grid2", "organ"])
def test_a_stroke_clean_through_asks_for_two(scene, name):
    mesh = SCENES[scene].mesh()
    stroke = plan_stroke(name, mesh, lowest=0.0)  # where a table would stop it
    assert asked_pieces(stroke, lying(mesh), NODE_SIZE) == 2


@pytest.mark.parametrize("x", [0.02, 0.0201, 0.025])  # a plane of nodes, near it, between two
def test_an_edge_that_goes_all_through_asks_for_two_wherever_nodes_are(x):
    assert pieces(along_y(x)) == 2
    assert pieces(along_y(x, low=0.0)) == 2  # it ends on the underside


def test_cuts_in_turn_ask_for_what_they_part_together():
    assert pieces(along_y(0.012), along_y(0.028)) == 3
    assert pieces(along_y(0.018), along_x(0.033)) == 4
    assert pieces(along_y(0.018), along_y(0.018)) == 2


@pytest.mark.parametrize(
    "table",
    [along_y(0.018, low=0.002), along_y(0.018, end=0.055), StrokeTable(kind="incision")],
)
def test_a_slit_asks_for_one(table):
    assert pieces(table) == 1


def test_a_body_in_two_pieces_is_in_three_afterwards():
    n = len(SLAB.positions)
    beside = SLAB.positions + np.array([0.1, 0.0, 0.0])
    both = TetrahedralMesh(
        np.vstack([SLAB.positions, beside]), np.vstack([SLAB.tetrahedra, SLAB.tetrahedra + n])
    )
    assert pieces(along_y(0.018), mesh=both) == 3


def test_a_corner_smaller_than_a_node_is_no_piece():
    diagonal = [[0.004, -0.002, -0.005], [-0.002, 0.004, -0.005]]
    table = StrokeTable(kind="points", points=diagonal, length=0.06)
    fine = block((20, 30, 4), SIZE)
    stroke = stroke_through(fine, [table], Material())
    assert asked_pieces(stroke, lying(fine), 0.01) == 1


def test_a_press_says_nothing_of_pieces():
    assert pieces(StrokeTable(kind="press")) is None
