"""A simulation that is put back does the same frames again: arm, coupling, tissue, recording."""

import threading
from contextlib import closing
from typing import get_args

import numpy as np
import pytest

from bridge import TcpLink
from bridge.tcp.server import TissueServer
from scalpel_sim import SCENES, prepare
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.pictures import state_of
from scalpel_sim.viewer.scene_packets import ScenePackets
from tests.support.run_files import untimed
from tissue import StateError, SurfaceQuantity

N_AFTER = 60


def go_on(simulation):
    """Do some frames; return the rows of all, and the counters."""
    for _ in range(N_AFTER):
        simulation.step()
    return untimed(simulation.recording), simulation.bridge.counters


def picture(simulation):
    """Return what a page is told to show of a simulation."""
    packets = ScenePackets(shapes_of(simulation.arm.model), simulation.frame)
    return packets.frame(state_of(simulation, get_args(SurfaceQuantity)))


@pytest.mark.parametrize(
    ("scene", "seconds"), [("slab", 0.4), ("retract", 0.9)], ids=["cut", "second hand"]
)
def test_a_simulation_that_is_put_back_does_the_same_frames_again(scene, seconds):
    simulation = prepare(SCENES[scene])
    simulation.run(seconds)
    state, shown = simulation.save_state(), picture(simulation)
    expected, counted = go_on(simulation)
    assert picture(simulation) != shown
    for _ in range(2):
        simulation.load_state(state)
        assert picture(simulation) == shown
        assert len(simulation.recording) == state.n_frames
        found, counters = go_on(simulation)
        assert np.array_equal(found, expected, equal_nan=True)
        assert counters == counted


def test_a_hand_that_closed_after_a_state_is_open_once_it_is_loaded():
    simulation = prepare(SCENES["retract"])
    state = simulation.save_state()
    simulation.run(1.0)
    (grasper,) = simulation.graspers
    assert grasper.n_points > 0
    simulation.load_state(state)
    assert grasper.n_points == 0
    assert grasper.grasper.opening > 0.0


def test_a_state_of_another_simulation_is_refused():
    one, other = (prepare(SCENES["slab"]) for _ in range(2))
    with pytest.raises(StateError, match="another simulation"):
        other.load_state(one.save_state())


def test_the_state_of_a_tissue_in_another_process_is_refused():
    scene = SCENES["slab"]
    server = TissueServer(lambda: make_tissue(scene), scene=scene.name, port=0)
    threading.Thread(target=server.run, daemon=True).start()
    with (
        closing(TcpLink(server.address)) as link,
        pytest.raises(StateError, match="run without --connect"),
    ):
        prepare(scene, link).save_state()
