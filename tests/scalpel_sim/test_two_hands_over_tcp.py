"""Scenes of two hands whose tissue is in another process: what they do, to the bit."""

import msgspec
import numpy as np
import pytest

from bridge import LinkError
from scalpel_sim import prepare
from scalpel_sim.scene.read import scene_in, shipped_scene, with_settings
from scalpel_sim.scene.scene import changed
from scalpel_sim.scene.schema import WaypointTable
from tests.bridge.bits import bits
from tests.scalpel_sim.served_scenes import served
from tests.support.run_files import assert_same_rows

COARSE = scene_in(
    with_settings(shipped_scene("excise"), ("solver.audit=true", "body.cells=[18, 12, 2]"))
)
TIED = {"holds": "attachment"}
RUBBED = {"holds": "friction", "closed": None, "force": 0.5}
SECONDS = 0.9


def closing_and_opening(**how):
    """The sheet of `excise`: the left hand closes on its edge, lifts it, lets go, and goes away."""
    (left,) = COARSE.graspers
    far, near, up = (0.03, 0.07, 0.004), (0.03, 0.04, 0.004), (0.03, 0.04, 0.009)
    turned = {"approach": (0.0, -1.0, 0.0), "across": (0.0, 0.0, 1.0)}
    rows = [(0.0, far, 0.016), (0.15, near, 0.016), (0.3, near, 0.0), (0.5, up, 0.0)]
    motion = [
        WaypointTable(time=time, at=at, opening=opening, **turned)
        for time, at, opening in [*rows, (0.65, up, 0.016), (0.85, far, 0.016)]
    ]
    grasper = msgspec.structs.replace(left, motion=motion, **how)
    return changed(COARSE, graspers=(grasper,))


def ran(scene, link=None):
    simulation = prepare(scene, link)
    simulation.run(SECONDS)
    return simulation


@pytest.mark.parametrize("how", [TIED, RUBBED], ids=["tied", "by friction"])
def test_a_grasper_closes_holds_and_lets_go_over_tcp_as_in_process_bit_for_bit(how):
    scene = closing_and_opening(**how)
    here = ran(scene)
    with served(scene) as link:
        there = ran(scene, link)
        assert bits(here.link.snapshot()) == bits(link.snapshot())
    assert_same_rows(here.recording, there.recording)
    recording = there.recording
    time, force = recording.column("time_s"), recording.vector("left_force")
    held = (time > 0.4) & (time < 0.5)
    assert (force[held, 2] < -5e-3).all()  # the weight of what it lifts
    assert (recording.column("left_points")[held] > 0).all() == (how == TIED)
    assert (recording.column("left_points")[-50:] == 0).all()
    assert np.abs(force[-1]).max() < 1e-3


def test_the_contacts_of_each_pad_add_up_to_the_force_on_its_jaw():
    scene = closing_and_opening(**RUBBED)
    with served(scene) as link:
        simulation = prepare(scene, link)
        simulation.run(0.45)
        coupling, model = simulation.coupled_bodies[1], simulation.arm.model
        found = coupling.forces()
        for name in ("left_grasper_jaw_low", "left_grasper_jaw_high"):
            mine = model.geom_bodyid[found.geom] == model.body(name).id
            pressed = coupling.wrench(name).force
            assert np.linalg.norm(pressed) > 0.1
            assert found.force[mine].sum(axis=0) == pytest.approx(pressed, abs=1e-9)


def test_a_server_that_is_lost_while_a_grasper_holds_ends_the_run():
    scene = closing_and_opening(**TIED)
    with served(scene) as link:
        simulation = prepare(scene, link)
        simulation.run(0.35)
        assert simulation.graspers[0].n_points > 0
        link.close()
        with pytest.raises(LinkError, match="is closed"):
            simulation.run(0.4)
