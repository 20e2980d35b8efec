"""An incision goes in from above, along the longer side at one depth, and out again."""

import itertools

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.runs.run import REST_AFTER_STROKE
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.asked import asked_area
from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.kinds.incision import (
    DEPTH,
    INSERTED_AT,
    SLOPE,
    WITHDRAWN_AT,
    WITHDRAWN_LATEST,
)
from tests.support.planned_strokes import plan_incision, plan_stroke
from tissue import MATERIALS, BladeSweep, TetrahedralMesh, block, pieces_of

SLAB = block((4, 6, 4), (0.04, 0.06, 0.04))


def tips(mesh, **settings):
    poses = plan_incision(mesh, **settings).poses(500)
    return np.array([pose.tip for pose in poses])


def test_the_tip_goes_straight_in_along_the_longer_side_and_straight_out():
    path = tips(SLAB)
    begin, end, top = INSERTED_AT * 0.06, WITHDRAWN_AT * 0.06, 0.04
    np.testing.assert_allclose(path[:, 0], 0.02)
    assert path[0, 2] > top and path[-1, 2] > top
    is_drawn = (path[:, 1] > begin + 1e-6) & (path[:, 1] < end - 1e-6)
    np.testing.assert_allclose(path[is_drawn, 2], top - DEPTH, atol=1e-9)
    np.testing.assert_allclose([path[0, 1], path[-1, 1]], [begin, end])
    assert (np.diff(path[:, 1]) > -1e-12).all()


def test_the_tip_is_drawn_on_by_the_drag_and_not_out_of_the_body():
    end, longest = WITHDRAWN_AT * 0.06, WITHDRAWN_LATEST * 0.06
    assert tips(SLAB, drag=2e-3)[-1, 1] == pytest.approx(end + 2e-3)
    assert tips(SLAB, drag=1.0)[-1, 1] == pytest.approx(longest)


@pytest.mark.parametrize("along", [(0.3, 0.6), (0.7, 0.25)])
def test_the_tip_goes_in_and_out_where_it_is_asked_to(along):
    path = tips(SLAB, along=along)
    np.testing.assert_allclose([path[0, 1], path[-1, 1]], 0.06 * np.array(along))


def test_an_incision_that_is_drawn_the_other_way_is_the_mirror_image():
    """The tip, the lean of the edge, the drag and where it ends at the latest; the area too."""
    here, there = (
        plan_incision(SLAB, drag=4e-3, along=along) for along in ((0.2, 0.8), (0.8, 0.2))
    )
    mirror = np.array([1.0, -1.0, 1.0])
    for pose, other in zip(here.poses(50), there.poses(50), strict=True):
        np.testing.assert_allclose(other.tip, [0.0, 0.06, 0.0] + mirror * pose.tip, atol=1e-12)
        np.testing.assert_allclose(other.heel, [0.0, 0.06, 0.0] + mirror * pose.heel, atol=1e-12)
        np.testing.assert_allclose(other.forward, mirror * pose.forward, atol=1e-12)
    assert there.asked[0][1] == pytest.approx(here.asked[0][1])
    assert there.pose(there.duration).tip[1] == pytest.approx(0.06 * (1.0 - WITHDRAWN_LATEST))


def test_an_incision_of_no_length_is_refused():
    with pytest.raises(StrokeError, match=r"goes in at 0\.5 of the body's length"):
        plan_incision(SLAB, along=(0.5, 0.52))


def test_the_edge_slopes_with_its_heel_ahead_and_faces_forward_and_down():
    for pose in plan_incision(SLAB).poses(5):
        edge = (pose.heel - pose.tip) / np.linalg.norm(pose.heel - pose.tip)
        np.testing.assert_allclose(edge, [0.0, np.cos(SLOPE), np.sin(SLOPE)], atol=1e-12)
        np.testing.assert_allclose(pose.forward, [0.0, np.sin(SLOPE), -np.cos(SLOPE)], atol=1e-12)


def test_the_tip_follows_a_surface_that_slopes():
    positions = SLAB.positions.copy()
    positions[:, 2] *= 1.0 + 5.0 * positions[:, 1]  # from 40 to 52 mm high
    path = tips(TetrahedralMesh(positions, SLAB.tetrahedra), depth=5e-3)
    is_drawn = (path[:, 1] > INSERTED_AT * 0.06 + 1e-6) & (path[:, 1] < WITHDRAWN_AT * 0.06 - 1e-6)
    surface = 0.04 * (1.0 + 5.0 * path[is_drawn, 1])
    np.testing.assert_allclose(path[is_drawn, 2], surface - 5e-3, atol=1e-9)


def test_a_thin_body_is_not_cut_through():
    assert tips(block((6, 4, 1), (0.06, 0.04, 0.01)))[:, 2].min() == pytest.approx(0.007)


def test_a_body_with_a_gap_along_its_middle_is_refused():
    mesh = block((3, 9, 1), (0.03, 0.09, 0.01))
    centres = mesh.positions[mesh.tetrahedra].mean(axis=1)
    is_hole = (np.abs(centres[:, 0] - 0.015) < 0.005) & (np.abs(centres[:, 1] - 0.045) < 0.015)
    with pytest.raises(StrokeError, match="no body along the middle"):
        plan_stroke("incision", TetrahedralMesh(mesh.positions, mesh.tetrahedra[~is_hole]))


def test_liver_as_published_is_cut_with_toughness_times_depth_and_pays_for_it():
    """4.74 kPa and 164 J/m2, by an arm: 1.31 N. It ends in the organ, within an element.

    The mesh opens at its nodes, in the middle 9.1 mm deep where 8 are asked for: the force lies
    between that of the depth asked for and that of what is opened.
    """
    simulation = prepare(changed(SCENES["incision"], audit=True))
    asked = asked_area(simulation.stroke, simulation.link.snapshot())
    areas = []
    simulation.run(
        simulation.stroke.duration + REST_AFTER_STROKE,
        lambda each: areas.append(each.result.cut_area),
    )
    x = simulation.recording.vector("tip")[:, 0]
    middle = np.abs(x - x.mean()) < 0.25 * np.ptp(x)
    drawn = -simulation.recording.vector("tissue_force")[middle, 0].mean()
    opened_there = np.ptp(np.array(areas)[middle]) / np.ptp(x[middle])
    assert 0.95 * 164.0 * DEPTH <= drawn <= 1.02 * 164.0 * opened_there
    energies, opened = simulation.result.energies, simulation.result.cut_area
    assert opened == pytest.approx(asked, rel=0.05)
    # By 0.1 permille of toughness it changes by 0.04: the mesh opens at its nodes, and roughly. By
    # 5e-15 m of the arm's place it went from within 0.1 to 0.101.
    assert energies.cutting / 164.0 == pytest.approx(opened, rel=0.12)
    assert abs(energies.residual) < 0.01 * energies.work_of_blade
    assert simulation.link.cut_report().now.inverted == 0.0
    assert len(pieces_of(simulation.link.snapshot())) == 1


@pytest.mark.parametrize("name", ["kidney", "muscle"])
def test_an_incision_in_tissue_that_is_dragged_along_has_the_area_that_is_asked_for(name):
    """Tissues other than liver, which the drag was measured in; by a blade that nothing turns."""
    scene = changed(SCENES["incision"], material=MATERIALS[name].material)
    tissue = make_tissue(scene)
    lying = tissue.snapshot()
    mesh = TetrahedralMesh(lying.positions, lying.tetrahedra)
    stroke = plan_stroke("incision", mesh, speed=scene.speed, material=scene.material)
    for before, after in itertools.pairwise(stroke.poses(round(stroke.duration / 1e-3) + 1)):
        result = tissue.step(BladeSweep(before, after), 1e-3)
    # Muscle has 0.947 on one processor, and had more than 0.95 on another.
    assert result.cut_area == pytest.approx(asked_area(stroke, lying), rel=0.06)
    assert result.finished_area == 0.0
    assert tissue.cut_report().now.inverted == 0.0
    assert len(pieces_of(tissue.snapshot())) == 1
