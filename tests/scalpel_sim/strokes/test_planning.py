from functools import partial

import numpy as np
import pytest

from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.planning import check_meets
from scalpel_sim.strokes.stroke import Stroke
from tests.support import bodies
from tests.support.planned_strokes import PLANNED, plan_stroke
from tests.support.soundness import n_pieces
from tissue import BladeSegment, Material, TetrahedralMesh, block, liver_lobe

THROUGH = ("straight", "slanted", "curved")

BODIES = {
    "slab": lambda: block((4, 6, 4), (0.04, 0.06, 0.04)),
    "grid2": lambda: block((2, 2, 2), (0.04, 0.04, 0.04)),
    "across": lambda: block((10, 3, 2), (0.10, 0.03, 0.02)),
    "tower": lambda: block((3, 3, 8), (0.02, 0.02, 0.10)),
    "narrow": lambda: block((2, 4, 4), (0.015, 0.06, 0.06)),
    "sheet on edge": lambda: block((5, 1, 5), (0.10, 0.006, 0.10)),
    "organ": liver_lobe,
} | {file: partial(bodies.third_party_mesh, file) for file in bodies.FILES if bodies.FOLDER}


def swept_side(stroke, points):
    """Return the side of the swept sheet that each point is on, by the pose level with it."""
    poses = stroke.poses(400)
    middles = np.array([(pose.tip + pose.heel) / 2.0 for pose in poses])
    forwards = np.array([pose.forward for pose in poses])
    edges = np.array([pose.tip - pose.heel for pose in poses])
    offsets = points[:, None] - middles[None]
    level = np.abs(np.einsum("npi,pi->np", offsets, forwards)).argmin(axis=1)
    normals = np.cross(edges, forwards)
    return np.einsum("ni,ni->n", offsets[np.arange(len(points)), level], normals[level]) > 0.0


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("name", THROUGH)
def test_a_stroke_clean_through_separates_left_from_right(body, name):
    mesh = BODIES[body]()
    stroke = plan_stroke(name, mesh)
    centroids = mesh.positions[mesh.tetrahedra].mean(axis=1)
    side = swept_side(stroke, centroids)
    x = centroids[:, 0]
    low, high = mesh.positions[:, 0].min(), mesh.positions[:, 0].max()
    left, right = x < low + 0.06 * (high - low), x > high - 0.06 * (high - low)
    assert len(set(side[left])) <= 1
    assert len(set(side[right])) <= 1
    if body not in ("tower", "narrow", "grid2"):  # their cells are too coarse to count parts by
        assert n_pieces(mesh.tetrahedra[side]) == n_pieces(mesh.tetrahedra[~side]) == 1
    assert 0.2 < mesh_share(mesh, side) < 0.8


def mesh_share(mesh, chosen):
    corners = mesh.positions[mesh.tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1])
    return volumes[chosen].sum() / volumes.sum()


@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize("name", THROUGH)
def test_the_blade_is_longer_than_the_section_and_leaves_the_body_behind(body, name):
    mesh = BODIES[body]()
    stroke = plan_stroke(name, mesh)
    for pose in stroke.poses(200):
        assert not near_body(mesh, pose.tip)
        assert not near_body(mesh, pose.heel)
    for pose in (stroke.pose(0.0), stroke.pose(stroke.duration)):
        along = np.linspace(pose.heel, pose.tip, 50)
        assert not any(near_body(mesh, point, 0.004) for point in along)


def near_body(mesh, point, clearance=0.003):
    """Return whether a point is in the body, or within a clearance [m] of one of its nodes."""
    corners = mesh.positions[mesh.tetrahedra]
    axes = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    weights = np.linalg.solve(axes, (point - corners[:, 0])[:, :, None])[:, :, 0]
    inside = (weights >= 0.0).all(axis=1) & (weights.sum(axis=1) <= 1.0)
    return inside.any() or np.linalg.norm(mesh.positions - point, axis=1).min() < clearance


@pytest.mark.parametrize("name", PLANNED)
@pytest.mark.parametrize("speed", [0.02, 0.06, 0.3])
def test_the_blade_starts_and_ends_at_rest_and_keeps_to_its_speed(name, speed):
    stroke = plan_stroke(name, BODIES["slab"](), speed=speed)
    times = np.arange(0.0, stroke.duration, 1e-3)
    middles = np.array([(pose.tip + pose.heel) / 2.0 for pose in map(stroke.pose, times)])
    speeds = np.linalg.norm(np.diff(middles, axis=0), axis=1) / 1e-3
    assert speeds.max() <= 1.001 * speed
    assert speeds[0] < 0.01 * speed
    assert speeds[-1] < 0.01 * speed
    assert np.abs(np.diff(speeds)).max() < 0.1 * speed  # no jerk: the ramp takes 20 poses


def test_the_edge_stands_in_a_slab_and_lies_on_a_sheet_on_edge():
    standing = plan_stroke("straight", BODIES["slab"]()).pose(0.0)
    assert np.allclose(standing.forward, [0.0, 1.0, 0.0])
    assert standing.tip[2] < 0.0 < 0.04 < standing.heel[2]
    lying = plan_stroke("straight", BODIES["sheet on edge"]()).pose(0.0)
    assert np.allclose(lying.forward, [0.0, 0.0, -1.0])
    assert lying.heel[1] < 0.0 < 0.006 < lying.tip[1]


def test_the_straight_stroke_is_in_the_middle():
    for pose in plan_stroke("straight", BODIES["slab"]()).poses(5):
        assert pose.tip[0] == pose.heel[0] == pytest.approx(0.02)


def test_the_slanted_sheet_leans_by_25_degrees_and_the_blade_is_raked_by_15():
    pose = plan_stroke("slanted", BODIES["slab"]()).pose(0.0)
    edge = (pose.tip - pose.heel) / np.linalg.norm(pose.tip - pose.heel)
    normal = np.cross(edge, pose.forward)
    assert np.degrees(np.arccos(abs(normal[0]))) == pytest.approx(25.0)
    assert np.degrees(np.arcsin(-edge[1])) == pytest.approx(15.0)  # the tip trails


def test_the_curved_sheet_bends_by_11_percent_and_the_blade_turns_along():
    stroke = plan_stroke("curved", BODIES["slab"]())
    poses = stroke.poses(2000)
    tips = np.array([pose.tip for pose in poses])
    within = (tips[:, 1] > 0.0) & (tips[:, 1] < 0.06)
    assert np.ptp(tips[within, 0]) == pytest.approx(0.11 * 0.06, rel=0.01)
    moves = np.diff(tips, axis=0)
    moving = np.linalg.norm(moves, axis=1) > 1e-5
    moves /= np.linalg.norm(moves, axis=1, keepdims=True)
    forwards = np.array([pose.forward for pose in poses[1:]])
    assert np.einsum("ij,ij->i", moves, forwards)[moving].min() > 0.9999


def test_a_sheet_through_a_narrow_body_leans_less_and_spares_the_held_sides():
    pose = plan_stroke("slanted", BODIES["narrow"]()).pose(0.0)
    normal = np.cross(pose.tip - pose.heel, pose.forward)
    assert 5.0 < np.degrees(np.arccos(abs(normal[0]) / np.linalg.norm(normal))) < 12.0


@pytest.mark.parametrize(("toughness", "share"), [(0.0, 0.55), (1e3, 0.9)])
def test_stop_ends_at_55_percent_or_later_where_the_body_is_dragged_but_inside(toughness, share):
    stroke = plan_stroke("stop", BODIES["across"](), material=Material(toughness=toughness))
    assert stroke.pose(stroke.duration).tip[1] == pytest.approx(share * 0.03)


def test_press_goes_half_as_deep_as_toughness_over_stiffness():
    material = Material(young_modulus=20e3, toughness=40.0)
    stroke = plan_stroke("press", BODIES["slab"](), material=material)
    assert stroke.pose(stroke.duration).tip[1] == pytest.approx(1e-3)
    deeper = plan_stroke("press", BODIES["slab"](), depth=2.5e-3)
    assert deeper.pose(deeper.duration).tip[1] == pytest.approx(2.5e-3)
    resting = deeper.pose(deeper.duration - 0.4)
    assert np.array_equal(resting.tip, deeper.pose(deeper.duration).tip)


@pytest.mark.parametrize(
    ("half_width", "displacement"),
    # Cantilevers of 20 x 20 mm, E = 10 kPa, with half of 20 J/m2 x 20 mm: F L^3 / 3EI + F L / GA.
    [(0.02, 0.2 * (0.02**3 / (3e4 * 0.02**4 / 12) + 0.02 / (1e4 / 3 * 0.02**2))), (0.15, 0.075)],
)
def test_the_stroke_is_longer_by_the_displacement_of_a_long_soft_body(half_width, displacement):
    mesh = block((8, 2, 2), (2 * half_width, 0.02, 0.02))
    stroke = plan_stroke("straight", mesh, material=Material(young_modulus=10e3, toughness=20.0))
    assert stroke.pose(stroke.duration).tip[1] == pytest.approx(0.02 + 0.015 + displacement)


def fork():
    """Return two prongs along x, joined on the right: a plane at the middle leaves three parts."""
    mesh = block((20, 3, 1), (0.10, 0.03, 0.01))
    centroids = mesh.positions[mesh.tetrahedra].mean(axis=1)
    slot = (centroids[:, 0] < 0.055) & (np.abs(centroids[:, 1] - 0.015) < 0.005)
    tetrahedra = mesh.tetrahedra[~slot]
    used, renumbered = np.unique(tetrahedra, return_inverse=True)
    return TetrahedralMesh(mesh.positions[used], renumbered.reshape(-1, 4))


@pytest.mark.parametrize("name", THROUGH)
def test_a_branched_body_is_cut_where_it_falls_into_two_parts(name):
    tip = plan_stroke(name, fork()).pose(0.5).tip
    assert tip[0] > 0.055


@pytest.mark.parametrize("speed", [0.0, -1.0, np.nan, np.inf])
def test_an_invalid_speed_is_refused(speed):
    with pytest.raises(StrokeError, match="speed of the stroke"):
        plan_stroke("straight", BODIES["slab"](), speed=speed)


def shifted(stroke, shift):
    poses = [
        pose._replace(tip=pose.tip + shift, heel=pose.heel + shift)
        for pose in map(stroke.pose, stroke.times)
    ]
    return Stroke(stroke.times, poses, "mine")


def test_a_stroke_beside_the_body_is_refused_with_the_distance():
    mesh = BODIES["slab"]()
    beside = shifted(plan_stroke("straight", mesh), [0.0325, 0.0, 0.0])
    with pytest.raises(
        StrokeError, match=r"'mine' stays 12\.5 mm away .* \(0, 0, 0\) to \(40, 60, 40\)"
    ):
        check_meets(beside, mesh)


def test_a_stroke_that_begins_and_ends_inside_meets_the_body():
    mesh = block((1, 1, 1), (0.1, 0.1, 0.1))
    forward = np.array([0.0, 1.0, 0.0])
    poses = [
        BladeSegment(np.array([0.05, y, 0.045]), np.array([0.05, y, 0.055]), forward)
        for y in (0.05, 0.055)
    ]
    check_meets(Stroke([0.0, 1.0], poses), mesh)


def test_a_table_far_below_the_body_changes_no_stroke():
    mesh = BODIES["slab"]()
    usual, above = plan_stroke("slanted", mesh), plan_stroke("slanted", mesh, lowest=-0.1)
    np.testing.assert_array_equal(usual.pose(0.3).tip, above.pose(0.3).tip)
    assert above.duration == usual.duration
