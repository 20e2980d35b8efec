"""A cut along a line on the skin follows it at one depth, in whatever shape the body lies."""

import numpy as np
import pytest
from trimesh import Trimesh
from trimesh.proximity import closest_point_naive

from scalpel_sim import SCENES, prepare
from scalpel_sim.arm.placement import PlacementError, place
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.strokes.scene_stroke import stroke_through
from scalpel_sim.strokes.skin import BodySkin
from scalpel_sim.strokes.skin_line import SHARPEST_BEND, lines_on_skin
from tissue import Material, TetrahedralMesh, block, boundary_faces

UP = np.array([0.0, 0.0, 1.0])
BLOCK = block((8, 6, 3), (0.08, 0.06, 0.03))
NO_DRAG = Material(young_modulus=1e4, toughness=0.0)
DEPTH = 5e-3

BEYOND = 1e-3
"""Way that the tip goes on beyond the line [m]."""

ON_SKIN = 1e-9
"""Distance from a face within which a place is on it [m]: rounding of coordinates of 0.1 m."""


def bulging(mesh, radius=0.1):
    """The block with its upper side bent to a cylinder along y, of that radius, at its middle."""
    positions = mesh.positions.copy()
    x = positions[:, 0] - 0.04
    positions[:, 2] *= 1.0 + (np.sqrt(radius**2 - x**2) - radius) / 0.03
    return TetrahedralMesh(positions, mesh.tetrahedra)


def traced(mesh, points, material=NO_DRAG, rest=None, **keys):
    row = StrokeTable(kind="traced", points=points, **{"depth": DEPTH, "speed": 0.05} | keys)
    return stroke_through(mesh, [row], material, rest=rest)


def tips_inside(stroke, top):
    """Tips of the blade while it is drawn: not on its way in or out."""
    tips = np.array([stroke.pose(t).tip for t in stroke.times])
    return tips[np.linalg.norm(tips - tips[0], axis=1) > top]


def test_the_line_lies_on_the_faces_of_a_curved_skin():
    mesh = bulging(BLOCK)
    points = np.array([(0.011, 0.012, 0.05), (0.043, 0.041, 0.0), (0.071, 0.013, 0.03)])
    line = np.vstack([each.lying for each in lines_on_skin(points, BodySkin.of(mesh), UP)])
    skin = Trimesh(mesh.positions, boundary_faces(mesh.tetrahedra), process=False)
    _, distances, _ = closest_point_naive(skin, line)
    assert distances.max() < ON_SKIN
    for point in points:  # seen along the edge the line goes through each point
        assert np.abs(line[:, :2] - point[:2]).sum(axis=1).min() < ON_SKIN


def test_the_tip_keeps_its_depth_under_a_curved_skin():
    mesh = bulging(BLOCK)
    stroke = traced(mesh, [(0.011, 0.03, 0.03), (0.069, 0.03, 0.03)])
    tips = tips_inside(stroke, 0.02)
    x = tips[:, 0] - 0.04
    sagitta = 0.01**2 / (8.0 * 0.1)  # of faces 10 mm wide under the cylinder
    depths = np.sqrt(0.1**2 - x**2) - 0.1 + 0.03 - tips[:, 2]
    during = tips[:, 0] < 0.069 - ON_SKIN
    assert np.abs(depths[during] - DEPTH).max() < 1.5 * sagitta
    skin = BodySkin.of(mesh)
    for tip in tips[during][::20]:
        above = skin.lying_place(skin.entered_at(tip, -UP))
        assert above[2] - tip[2] == pytest.approx(DEPTH, abs=1e-6)  # between places of the line


def test_the_depth_is_along_the_edge_that_is_given():
    edge = np.array([0.6, 0.0, 0.8])
    stroke = traced(BLOCK, [(0.03, 0.01, 0.03), (0.03, 0.05, 0.03)], edge=tuple(edge))
    middle = stroke.pose(0.5 * stroke.duration)
    np.testing.assert_allclose(middle.tip[[0, 2]], [0.03 - 0.6 * DEPTH, 0.03 - 0.8 * DEPTH])
    np.testing.assert_allclose((middle.heel - middle.tip) / stroke.blade_length, edge, atol=1e-12)


def test_the_edge_faces_along_the_line_and_turns_with_it():
    corner = [(0.02, 0.01, 0.03), (0.02, 0.04, 0.03), (0.06, 0.04, 0.03)]
    stroke = traced(BLOCK, corner)
    for pose in stroke.poses(501):
        gone_east = pose.tip[0] > 0.02 + 1e-6
        gone_north = 0.01 + 1e-6 < pose.tip[1] < 0.04 - 1e-6
        if gone_east or gone_north:
            facing = [1.0, 0.0, 0.0] if gone_east else [0.0, 1.0, 0.0]
            np.testing.assert_allclose(pose.forward, facing, atol=1e-6)


def test_the_blade_does_not_stop_at_a_bend_and_rests_at_a_corner():
    def slowest(turn):
        ends = np.array([[0.01, 0.02], [0.04, 0.02]])
        third = ends[1] + 0.03 * np.array([np.cos(turn), np.sin(turn)])
        stroke = traced(BLOCK, [(*xy, 0.03) for xy in (*ends, third)])
        t = np.linspace(0.0, stroke.duration, 2001)
        tips = np.array([stroke.pose(each).tip for each in t])
        near = np.linalg.norm(tips[:-1] - [0.04, 0.02, 0.025], axis=1) < 2e-3
        return (np.linalg.norm(np.diff(tips, axis=0), axis=1) / t[1])[near].min()

    assert slowest(0.9 * SHARPEST_BEND) > 0.04
    assert slowest(1.1 * SHARPEST_BEND) < 0.01


def test_the_points_mean_the_same_material_however_the_body_lies():
    lying = TetrahedralMesh(BLOCK.positions * [1.2, 0.9, 0.95] + 0.01, BLOCK.tetrahedra)
    stroke = traced(lying, [(0.02, 0.03, 0.03), (0.06, 0.03, 0.03)], rest=BLOCK.positions)
    tips = tips_inside(stroke, 0.02)
    np.testing.assert_allclose(tips[:, 1], 0.03 * 0.9 + 0.01, atol=ON_SKIN)
    np.testing.assert_allclose(tips[:, 0].max(), 0.06 * 1.2 + 0.01 + BEYOND, atol=ON_SKIN)
    np.testing.assert_allclose(tips[:10, 2], 0.03 * 0.95 + 0.01 - DEPTH, atol=ON_SKIN)


@pytest.mark.parametrize(
    ("points", "keys", "message"),
    [
        ([(0.02, 0.03, 0.03), (0.09, 0.03, 0.03)], {}, r"point 1 to point 2 .* misses the body"),
        ([(-0.01, 0.03, 0.03), (0.06, 0.03, 0.03)], {}, r"point 1 .*\(-10.0, 30.0, 30.0\) mm"),
        ([(0.02, 0.03, 0.03), (0.02, 0.03, 0.01)], {}, "points 1 and 2 .* are one place"),
        (
            [(0.02, 0.03, 0.03), (0.06, 0.03, 0.03)],
            {"edge": (1.0, 0.0, 0.1)},
            "steeper than 75 degrees",
        ),
    ],
)
def test_a_line_that_cannot_be_cut_says_why(points, keys, message):
    with pytest.raises(StrokeError, match=message):
        traced(BLOCK, points, **keys)


def test_a_line_that_no_arm_reaches_is_refused():
    huge = TetrahedralMesh(20.0 * BLOCK.positions, BLOCK.tetrahedra)
    stroke = traced(huge, [(0.1, 0.6, 0.6), (1.5, 0.6, 0.6)])
    bounds = np.stack([huge.positions.min(axis=0), huge.positions.max(axis=0)])
    with pytest.raises(PlacementError, match="reach"):
        place(stroke, bounds)


def test_a_cut_along_a_line_on_the_organ_is_as_long_and_as_deep_as_the_line():
    points = [(0.031, 0.024, 0.034), (0.054, 0.030, 0.034)]
    row = StrokeTable(kind="traced", points=points, depth=6e-3, speed=0.03)
    simulation = prepare(changed(SCENES["organ"], strokes=(row,)))
    simulation.run(simulation.duration + 0.3)
    length = float(np.linalg.norm(np.subtract(*points)[:2]))
    assert simulation.bridge.result.cut_area == pytest.approx(6e-3 * length, rel=0.1)
