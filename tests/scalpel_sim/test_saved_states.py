"""A simulation, or one that was made alike, goes on from a state with the same bits."""

import io
import sys
from typing import get_args

import numpy as np
import pytest

from scalpel_sim import SCENES, SimulationState, prepare
from scalpel_sim.scene.scene import changed
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.pictures import state_of
from scalpel_sim.viewer.scene_packets import ScenePackets
from tests.support.run_files import untimed
from tissue import StateError, SurfaceQuantity, TissueState

SLAB = SCENES["slab"]
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


def with_rows_of(other, scene):
    """Return a simulation at its start that has the recording of another."""
    simulation = prepare(scene)
    for row in other.recording.rows:
        simulation.recording.append(row)
    return simulation


def arrays_of(data):
    """Return what is in the bytes of a state, by the names of the arrays."""
    with np.load(io.BytesIO(data)) as file:
        return {name: file[name].tobytes() for name in file.files}


@pytest.mark.parametrize(("scene", "seconds"), [("slab", 0.4), ("retract", 0.9), ("grid2", 0.3)])
def test_a_simulation_and_one_made_alike_go_on_from_a_state_with_the_same_bits(scene, seconds):
    simulation = prepare(SCENES[scene])
    simulation.run(seconds)
    state, shown = simulation.save_state(), picture(simulation)
    other, at_once = with_rows_of(simulation, SCENES[scene]), state.to_bytes()
    expected, counted = go_on(simulation)
    assert arrays_of(state.to_bytes()) == arrays_of(at_once), "of then, and not of now"
    of_bytes = SimulationState.from_bytes(at_once)
    assert picture(simulation) != shown
    for each, saved in ((simulation, state), (simulation, state), (other, of_bytes)):
        each.load_state(saved)
        assert picture(each) == shown
        assert len(each.recording) == saved.n_frames
        found, counters = go_on(each)
        assert np.array_equal(found, expected, equal_nan=True)
        assert counters == counted
    assert other.touching.frames == simulation.touching.frames


def test_a_state_after_a_release_goes_on_where_nothing_was_ever_held():
    simulation = prepare(SLAB)
    frame = simulation.bridge.attach("top", stiffness=10.0)
    simulation.step()
    simulation.bridge.release(frame)
    simulation.step()
    other = with_rows_of(simulation, SLAB)
    other.load_state(SimulationState.from_bytes(simulation.save_state().to_bytes()))
    assert simulation.link.loads()[0].n_points == other.link.loads()[0].n_points == 0
    assert np.array_equal(go_on(other)[0], go_on(simulation)[0], equal_nan=True)


def arrays_in(value):
    """Return the arrays in a constant."""
    if isinstance(value, np.ndarray):
        return [value]
    return [each for item in value for each in arrays_in(item)] if type(value) is tuple else []


def constants():
    """Return copies of the arrays that modules of the project hold, by their names."""
    ours = [m for n, m in sys.modules.items() if n.startswith(("tissue.", "bridge.", "scalpel_"))]
    return {
        (module.__name__, name, i): array.copy()
        for module in ours
        for name, value in vars(module).items()
        for i, array in enumerate(arrays_in(tuple(value) if isinstance(value, tuple) else value))
    }


def test_loading_bytes_changes_no_constant():
    simulation = prepare(SCENES["retract"])
    simulation.run(0.9)
    other = with_rows_of(simulation, SCENES["retract"])
    before = constants()
    assert ("scalpel_sim.instruments.blade_instrument", "NO_WRENCH", 0) in before
    other.load_state(SimulationState.from_bytes(simulation.save_state().to_bytes()))
    other.step()
    after = constants()
    assert [name for name in before if not np.array_equal(before[name], after[name])] == []


@pytest.mark.parametrize(
    ("changes", "differs"),
    [
        ({"tissue_every": 2}, "tissue_every"),
        ({"stroke": "curved"}, "the stroke"),
        ({"preset": "premium"}, "the arm"),
    ],
)
def test_bytes_of_a_simulation_with_other_settings_are_refused(changes, differs):
    data = prepare(SLAB).save_state().to_bytes()
    other = prepare(changed(SLAB, **changes))
    with pytest.raises(StateError, match=differs):
        other.load_state(SimulationState.from_bytes(data))


def test_bytes_of_another_body_are_refused_and_nothing_is_changed():
    simulation = prepare(SLAB)
    simulation.run(0.1)
    other = prepare(SCENES["grid2"])
    other.run(0.1)
    untouched = prepare(SCENES["grid2"])
    untouched.run(0.1)
    with pytest.raises(StateError):
        other.load_state(SimulationState.from_bytes(simulation.save_state().to_bytes()))
    assert np.array_equal(go_on(other)[0], go_on(untouched)[0], equal_nan=True)


def test_the_bytes_of_a_tissue_alone_are_no_state_of_a_simulation():
    simulation = prepare(SLAB)
    data = simulation.link.tissue.save_state().to_bytes()
    with pytest.raises(StateError, match="of a tissue alone"):
        SimulationState.from_bytes(data)
    with pytest.raises(StateError, match="no Simulation here"):
        simulation.link.tissue.load_state(
            TissueState.from_bytes(simulation.save_state().to_bytes())
        )


@pytest.mark.parametrize("damage", ["cut short", "a bit flipped"])
def test_damaged_bytes_are_refused(damage):
    data = bytearray(prepare(SLAB).save_state().to_bytes())
    if damage == "cut short":
        del data[len(data) // 2 :]
    else:
        data[len(data) // 2] ^= 16
    with pytest.raises(StateError, match="missing or damaged"):
        SimulationState.from_bytes(bytes(data))


def test_a_state_of_another_simulation_is_refused():
    one, other = (prepare(SCENES["slab"]) for _ in range(2))
    with pytest.raises(StateError, match="another simulation"):
        other.load_state(one.save_state())


def test_bytes_that_are_loaded_change_nothing_of_the_start():
    simulation = prepare(SLAB, records=False)
    simulation.run(0.002)
    simulation.note_start()
    start = simulation.blade.segment.numbers, simulation.wrench.numbers
    simulation.run(0.4)
    later = SimulationState.from_bytes(simulation.save_state().to_bytes())
    simulation.reset()
    simulation.load_state(later)
    assert simulation.blade.segment.numbers != start[0]
    simulation.reset()
    assert (simulation.blade.segment.numbers, simulation.wrench.numbers) == start
