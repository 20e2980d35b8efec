"""The draped stand below a body: it is below all that moves, and stands on the floor."""

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.viewer.model_shapes import body_poses, in_world, shapes_of
from scalpel_sim.viewer.stand import DRAPE_MARGIN, TRAY_GAP, stand_under
from tests.scalpel_sim.little_arm import little_arm

ROUNDING = 1e-9
"""[m]"""


def stand_of(simulation):
    """Return the stand of a scene, its meshes' points, and what they must be clear of."""
    shapes, poses = list(shapes_of(simulation.arm.model)), body_poses(simulation.arm.data)
    body = simulation.frame.points_to_world(simulation.link.surface().positions)
    stand = stand_under(shapes, poses, body)
    others = [
        in_world(shape, poses, shape.mesh.positions)
        for shape in shapes
        if not shape.is_table and shape.kind != 0
    ]
    return stand, body, others


@pytest.mark.parametrize("name", SCENES)
def test_a_shipped_scene_has_a_stand_below_its_body_and_clear_of_its_arms(name):
    simulation = prepare(SCENES[name], is_led=True, records=False)
    stand, body, others = stand_of(simulation)
    points = np.concatenate([mesh.positions for mesh in stand if mesh is not None])
    assert points[:, 2].min() == pytest.approx(0.0, abs=ROUNDING), "it stands on the floor"
    has_table = SCENES[name].world.table is not None
    assert (stand.tray is None) == has_table
    if not has_table:
        assert body[:, 2].min() - points[:, 2].max() >= TRAY_GAP - ROUNDING
    low, high = points.min(axis=0), points.max(axis=0)
    middle = 0.5 * (body.min(axis=0) + body.max(axis=0))
    assert (low[:2] < middle[:2]).all() and (middle[:2] < high[:2]).all()
    for corners in others:
        is_apart = (corners.min(axis=0) > high - ROUNDING) | (corners.max(axis=0) < low + ROUNDING)
        assert is_apart.any()


@pytest.mark.parametrize("scene", ["grid2", "gelatin"])
def test_a_stroke_goes_clear_of_the_stand(scene):
    simulation = prepare(SCENES[scene], records=False)
    top = max(mesh.positions[:, 2].max() for mesh in stand_of(simulation)[0])
    lowest = np.inf
    shapes = [shape for shape in shapes_of(simulation.arm.model) if shape.is_end]

    def look(running):
        nonlocal lowest
        poses = body_poses(running.arm.data)
        for shape in shapes:
            lowest = min(lowest, in_world(shape, poses, shape.mesh.positions)[:, 2].min())

    simulation.run(simulation.duration, look)
    assert lowest > top


def test_a_body_on_the_floor_and_one_without_a_floor_have_no_stand():
    model, data = little_arm()
    shapes, poses = list(shapes_of(model)), body_poses(data)
    block = np.array([[-0.02, -0.03, 0.0], [0.02, 0.03, 0.04]])
    assert stand_under(shapes, poses, block) is None
    above = block + np.array([0.0, 0.0, 0.1])
    assert stand_under(shapes, poses, above) is not None
    assert stand_under([shape for shape in shapes if shape.kind != 0], poses, above) is None


@pytest.mark.parametrize("scale", [0.5, 1.0, 3.0])
def test_a_stand_is_as_large_as_its_body_asks_for(scale):
    model, data = little_arm()
    floor = [shape for shape in shapes_of(model) if shape.kind == 0]
    block = scale * np.array([[-0.02, -0.03, 0.0], [0.02, 0.03, 0.04]]) + [0.0, 0.0, 0.5]
    drape, tray = stand_under(floor, body_poses(data), block)
    diagonal = np.linalg.norm(np.ptp(block, axis=0))
    beyond = (np.ptp(drape.positions, axis=0) - np.ptp(block, axis=0))[:2] / (2.0 * diagonal)
    assert (np.abs(beyond - DRAPE_MARGIN) < 0.1).all()
    for mesh in (drape, tray):
        a, b, c = (mesh.positions[mesh.triangles[:, corner]] for corner in range(3))
        outward = np.cross(b - a, c - a)
        turned = np.einsum("ij,ikj->ik", outward, mesh.normals[mesh.triangles])
        assert (turned[np.linalg.norm(outward, axis=1) > 0.0] > 0.0).mean() > 0.98
