"""A table in a scene: bodies lie on it, and a stroke through it is told so."""

import logging

import numpy as np
import pytest

from scalpel_sim import SCENES, StrokeTable, prepare
from scalpel_sim.arm.standing import TABLETOP
from scalpel_sim.scene.scene import changed

SLAB = changed(SCENES["slab"], table=-1e-4)


def through(depth):
    """A scene in which the tip is let down beside the body, that deep below the table [m]."""
    low = SLAB.world.table - depth
    points = [[0.02, -0.01, 0.005], [0.02, -0.01, low], [0.02, 0.05, low]]
    stroke = StrokeTable(kind="points", points=points, length=0.045, forward=[0.0, 1.0, 0.0])
    return changed(SLAB, strokes=(stroke,))


def test_the_table_stands_in_the_model_where_the_tissue_has_it():
    simulation = prepare(SLAB)
    board = simulation.arm.data.geom(TABLETOP)
    half = simulation.arm.model.geom(TABLETOP).size
    top = board.xpos + np.array([0.0, 0.0, half[2]])
    assert simulation.frame.points_to_tissue(top)[2] == pytest.approx(SLAB.world.table, abs=1e-12)


@pytest.mark.parametrize("name", ["retract", "excise", "taut_incision"])
def test_arms_stand_clear_of_the_board_on_their_whole_ways(name):
    simulation = prepare(SCENES[name])
    data, still = simulation.arm.data, simulation.link.tissue.step(None, simulation.dt)
    simulation.link.step = lambda sweep, dt, *led: still  # only the arms move
    del simulation.coupled_bodies[1:]
    touching = []
    simulation.run(simulation.duration, lambda now: touching.append(data.ncon))
    assert not any(touching)


@pytest.mark.parametrize(("depth", "said"), [(0.003, True), (-5e-4, False)])
def test_a_stroke_below_the_table_gets_a_warning(depth, said, caplog):
    with caplog.at_level(logging.WARNING, "scalpel_sim"):
        prepare(through(depth))
    assert ("3 mm below the table" in caplog.text) == said


@pytest.mark.parametrize("kind", ["straight", "slanted", "curved"])
def test_a_planned_stroke_ends_on_the_table_without_a_warning(kind, caplog):
    with caplog.at_level(logging.WARNING, "scalpel_sim"):
        simulation = prepare(changed(SCENES["organ"], strokes=(StrokeTable(kind=kind),)))
    poses = map(simulation.stroke.pose, simulation.stroke.times.tolist())
    lowest = min(min(pose.tip[2], pose.heel[2]) for pose in poses)
    assert lowest == pytest.approx(SCENES["organ"].world.table, abs=1e-12) and caplog.text == ""


def test_the_table_stops_the_blade():
    simulation = prepare(through(0.003))
    simulation.run(simulation.duration)
    tip = simulation.recording.vector("tip")[:, 2].min()
    height = simulation.frame.points_to_world(np.array([0.0, 0.0, SLAB.world.table]))[2]
    assert tip > height - 1e-3
