"""A run that goes on from a state at a random frame does what it would have done, to the bit."""

import numpy as np

from scalpel_sim import SCENES, SimulationState, prepare
from scalpel_sim.scene.scene import changed
from tests.support.battery import battery
from tests.support.run_files import assert_same_rows

LAST_FRAMES = {"grid2": 600, "slab": 700, "retract": 1000}
"""Frames until which cases are drawn: into the cut, and until a grasper holds and lifts."""

N_AFTER = 40


def scene_of(rng):
    """Return a scene, and the frame after which its state is saved."""
    name = str(rng.choice(list(LAST_FRAMES)))
    changes = {
        "tissue_every": int(rng.choice([1, 1, 3])),
        "coupling": str(rng.choice(["rigid", "rigid", "virtual"])),
    }
    if name != "retract":
        changes["relaxation"] = str(rng.choice(["global", "verlet"]))
    return changed(SCENES[name], **changes), int(rng.integers(0, LAST_FRAMES[name]))


@battery(n_per_change=6, n_long=1_000)
def test_a_simulation_made_alike_goes_on_from_bytes_at_any_frame(case):
    scene, n_frames = scene_of(np.random.default_rng(case))
    simulation, other = prepare(scene), prepare(scene)
    simulation.run(n_frames * simulation.dt)
    data = simulation.save_state().to_bytes()
    for row in simulation.recording.rows.tolist():
        other.recording.append(row)
    other.load_state(SimulationState.from_bytes(data))
    for each in (simulation, other):
        each.run((n_frames + N_AFTER) * each.dt)
    assert_same_rows(other.recording, simulation.recording)
    assert other.bridge.counters == simulation.bridge.counters
    ours, theirs = (each.link.snapshot() for each in (simulation, other))
    assert all(np.array_equal(a, b) for a, b in zip(ours, theirs, strict=True))
