"""A simulation that was made alike goes on from the bytes of a state with the same bits."""

import sys

import numpy as np
import pytest

from scalpel_sim import SCENES, SimulationState, prepare
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.test_saved_simulation import go_on, picture
from tissue import StateError, TissueState

SLAB = SCENES["slab"]


def with_rows_of(other, scene):
    """Return a simulation at its start that has the recording of another."""
    simulation = prepare(scene)
    for row in other.recording.rows:
        simulation.recording.append(row)
    return simulation


@pytest.mark.parametrize(
    ("scene", "seconds"),
    [("slab", 0.0), ("slab", 0.4), ("retract", 0.1), ("retract", 0.9), ("grid2", 0.3)],
)
def test_another_simulation_goes_on_from_the_bytes_of_a_state(scene, seconds):
    simulation = prepare(SCENES[scene])
    simulation.run(seconds)
    data = simulation.save_state().to_bytes()
    other = with_rows_of(simulation, SCENES[scene])
    shown = picture(simulation)
    expected, counted = go_on(simulation)
    other.load_state(SimulationState.from_bytes(data))
    assert picture(other) == shown
    found, counters = go_on(other)
    assert np.array_equal(found, expected, equal_nan=True)
    assert counters == counted
    assert other.touching.frames == simulation.touching.frames


def test_a_grasper_holds_what_it_held_once_bytes_are_loaded_and_can_let_go():
    scene = SCENES["retract"]
    simulation = prepare(scene)
    simulation.run(0.9)
    other = with_rows_of(simulation, scene)
    other.load_state(SimulationState.from_bytes(simulation.save_state().to_bytes()))
    (held,), (holds,) = simulation.graspers, other.graspers
    assert holds.n_points == held.n_points > 0
    assert holds.grip.wrench.numbers == held.grip.wrench.numbers
    holds.release()
    assert holds.n_points == 0


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
