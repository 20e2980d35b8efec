"""The plan of a task: a line and a depth, a surface of a file, or what the strokes are to cut."""

import numpy as np
import pytest
import trimesh

from scalpel_sim import SCENES, StrokeTable, changed, prepare
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.scoring.plan import plan_of
from scalpel_sim.strokes.asked import asked_area
from scalpel_sim.strokes.scene_stroke import stroke_through
from tissue import TetrahedralMesh, Tissue, block

SIZE = (0.04, 0.06, 0.04)


@pytest.fixture(scope="module")
def slab():
    """Return a body, and a stroke that parts it in its middle."""
    scene = changed(SCENES["slab"], stretch=0.0)
    simulation = prepare(scene, records=False)
    return simulation.stroke, simulation.link.snapshot()


def planned(slab, **task):
    return plan_of(TaskTable(**task), *slab)


def test_a_line_and_a_depth_are_a_sheet_below_the_skin(slab):
    plan = planned(slab, line=[(0.01, 0.01), (0.03, 0.05)], depth=0.006)
    length = np.hypot(0.02, 0.04)
    assert plan.area == pytest.approx(length * 0.006, rel=1e-3)
    below = 0.04 - plan.surface.points[:, 2]
    assert 0.0 < below.min() < below.max() < 0.006
    across = plan.surface.points[:, :2] - (0.01, 0.01)
    np.testing.assert_allclose(across @ (0.04, -0.02) / length, 0.0, atol=1e-9)
    np.testing.assert_allclose(np.abs(plan.surface.normals @ (0.04, -0.02, 0.0)) / length, 1.0)
    np.testing.assert_allclose(plan.line[:, 2], 0.04)
    np.testing.assert_allclose(plan.depths, 0.006, atol=1.3e-4)
    assert len(plan.stations) == pytest.approx(1e3 * length, abs=1.0)


def test_a_line_may_be_on_any_side_of_the_body(slab):
    line = [(0.001, 0.0, 0.02), (0.039, -0.01, 0.02)]
    plan = planned(slab, line=line, depth=0.01, into=(0.0, 2.0, 0.0))
    assert plan.area == pytest.approx(0.038 * 0.01, rel=1e-3)
    np.testing.assert_allclose(plan.line[:, 1], 0.0, atol=1e-9)
    np.testing.assert_allclose(plan.surface.points[:, 2], 0.02)


def test_what_a_line_plans_outside_the_body_does_not_count(slab):
    plan = planned(slab, line=[(0.02, 0.01), (0.02, 0.05)], depth=0.1)
    assert plan.area == pytest.approx(0.04 * 0.04, rel=1e-2)
    np.testing.assert_allclose(plan.depths, 0.04, atol=2e-4)


def test_a_line_beside_the_body_is_refused(slab):
    with pytest.raises(UsageError, match=r"\[task\] line misses the body at \(40.1, "):
        planned(slab, line=[(0.03, 0.03), (0.06, 0.03)], depth=0.01)


def test_a_surface_of_a_file_counts_as_far_as_it_is_in_the_body(slab, tmp_path):
    sheet = np.array([[0.02, -0.05, 0.0], [0.02, 0.07, 0.0], [0.02, 0.07, 0.1], [0.02, -0.05, 0.1]])
    path = tmp_path / "plan.stl"
    trimesh.Trimesh(sheet, [[0, 1, 2], [0, 2, 3]]).export(path)
    plan = planned(slab, surface=str(path))
    assert plan.area == pytest.approx(0.06 * 0.04, rel=1e-2)
    assert len(plan.stations) == 0


def test_a_file_that_is_no_surface_is_refused(slab, tmp_path):
    (tmp_path / "plan.stl").write_text("no surface")
    with pytest.raises(UsageError, match=r"other.stl cannot be read"):
        planned(slab, surface=str(tmp_path / "other.stl"))
    with pytest.raises(UsageError, match=r"plan.stl has no triangles"):
        planned(slab, surface=str(tmp_path / "plan.stl"))


@pytest.mark.parametrize("name", ["slab", "organ", "incision", "tumour"])
def test_the_strokes_plan_what_they_are_to_cut(name):
    simulation = prepare(SCENES[name], records=False)
    body = simulation.link.snapshot()
    plan = plan_of(TaskTable(), simulation.stroke, body)
    assert plan.area == pytest.approx(asked_area(simulation.stroke, body), rel=0.01)
    assert plan.into[2] < -0.95
    assert len(plan.stations) > 10


def test_the_plan_of_a_stroke_is_that_of_the_material(slab):
    """The same body, turned and moved: the plan lies in it at rest, wherever it is."""
    stroke, body = slab
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    elsewhere = body._replace(rest_positions=body.rest_positions @ turn.T + 0.1)
    one, other = (plan_of(TaskTable(), stroke, each) for each in (body, elsewhere))
    np.testing.assert_allclose(other.surface.points, one.surface.points @ turn.T + 0.1, atol=1e-9)
    np.testing.assert_allclose(other.surface.areas, one.surface.areas, rtol=1e-9)
    np.testing.assert_allclose(other.depths, one.depths, atol=1e-9)


def test_a_saw_plans_each_place_once():
    body = Tissue(block((4, 6, 4), SIZE), gravity=(0.0, 0.0, 0.0)).snapshot()
    rows = {"points": [(0.02, -0.02, -0.01), (0.02, 0.08, -0.01)], "length": 0.06}
    mesh = TetrahedralMesh(body.positions, body.tetrahedra)
    saw = StrokeTable(kind="points", saw_amplitude=0.005, saw_frequency=5.0, **rows)
    plan = plan_of(TaskTable(), stroke_through(mesh, [saw]), body)
    assert plan.area == pytest.approx(0.06 * 0.04, rel=0.02)
