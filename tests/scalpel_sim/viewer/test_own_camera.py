"""Cameras of scenes: they see body and working ends past the arms, from where the blade enters."""

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.viewer.model_shapes import body_poses, shapes_of
from scalpel_sim.viewer.own_camera import DISTANCE, hidden, own_eye, working_ends

N_POINTS = 50
"""Points of the surface to which rays are cast; others than the camera is chosen by."""

MOST_HIDDEN = 0.15
"""Share of them that may be behind a link, which the page draws faint there."""


@pytest.mark.parametrize("name", SCENES)
def test_body_and_working_ends_are_seen_in_each_view_of_a_scene_that_is_led(name):
    simulation = prepare(SCENES[name], is_led=True, records=False)
    shapes, poses = list(shapes_of(simulation.arm.model)), body_poses(simulation.arm.data)
    frame, positions = simulation.frame, simulation.link.surface().positions
    own = own_eye(shapes, poses, positions, frame)
    points = frame.points_to_world(np.random.default_rng(0).choice(positions, N_POINTS))
    ends = working_ends(shapes, poses)
    assert len(ends) == 1 + 2 * len(simulation.graspers)
    views = [frame.points_to_world(np.array(view.eye)) for view in SCENES[name].views]
    for eye in [own, *views]:
        assert hidden(eye, points, shapes, poses).mean() <= MOST_HIDDEN
        assert not hidden(eye, ends, shapes, poses).any()

    blade = simulation.arm.blade.segment()
    back = -blade.forward if abs(blade.forward[2]) < 0.85 else blade.heel - blade.tip
    assert (own - points.mean(axis=0))[:2] @ back[:2] > 0.0, "from where the blade enters"


def test_a_link_before_a_point_hides_it_and_one_beside_or_behind_it_does_not():
    simulation = prepare(SCENES["grid2"], is_led=True, records=False)
    shapes, poses = list(shapes_of(simulation.arm.model)), body_poses(simulation.arm.data)
    data = simulation.arm.data
    stylus = data.geom("stylus").xpos
    side = 0.1 * data.geom("stylus").xmat.reshape(3, 3)[:, 0]  # across the capsule
    points = np.array([stylus - side, stylus + 0.9 * side, stylus + 2.0 * side])
    assert hidden(stylus + side, points, shapes, poses).tolist() == [True, False, False]


def test_without_arms_the_camera_looks_along_the_tissues_own_axes():
    simulation = prepare(SCENES["grid2"], records=False)
    positions, frame = simulation.link.surface().positions, simulation.frame
    quarter = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    eye = own_eye([], np.empty((0, 7)), positions, frame)
    turned = own_eye([], np.empty((0, 7)), positions, type(frame)(rotation=quarter))
    centre = 0.5 * (positions.min(axis=0) + positions.max(axis=0))
    way = frame.points_to_tissue(eye) - centre
    assert turned @ quarter - centre == pytest.approx(way)
    assert way[1] < -abs(way[0]), "from where strokes begin"
    diagonal = np.linalg.norm(np.ptp(positions, axis=0))
    assert np.linalg.norm(way) == pytest.approx(DISTANCE * diagonal)
