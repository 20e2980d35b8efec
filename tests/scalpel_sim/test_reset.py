"""A simulation returns to its start, is observed by name, and need not record: for environments."""

import gc
import tracemalloc
import weakref

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.errors import UsageError
from scalpel_sim.recording.observations import farthest_points
from tests.scalpel_sim.served_scenes import served
from tests.support.run_files import untimed
from tissue import StateError

QUANTITIES = ("time", "tip", "force", "stiffness", "cut_area", "left_force", "left_opening")


def steps(simulation, seconds: float) -> np.ndarray:
    """Do frames; return the rows without wall times."""
    simulation.run(simulation.time + seconds)
    return untimed(simulation.recording)


@pytest.mark.parametrize(("scene", "seconds"), [("slab", 0.7), ("retract", 0.9)])
def test_a_reset_simulation_does_the_first_run_again_to_the_bit(scene, seconds):
    simulation = prepare(SCENES[scene])
    expected = steps(simulation, seconds)
    for _ in range(2):
        simulation.reset()
        assert simulation.time == 0.0 and len(simulation.recording) == 0
        assert np.array_equal(steps(simulation, seconds), expected, equal_nan=True)


def test_a_simulation_returns_to_the_start_that_was_noted():
    simulation = prepare(SCENES["slab"])
    simulation.run(0.7)
    simulation.note_start()
    cut = simulation.result.cut_area
    simulation.run(0.75)
    simulation.reset()
    assert simulation.n_frames == 700 and simulation.result.cut_area == cut > 0.0


def test_a_simulation_with_a_start_is_freed_with_its_last_reference():
    simulation = prepare(SCENES["slab"])
    simulation.run(0.002)
    simulation.reset()
    alive, was_enabled = weakref.ref(simulation), gc.isenabled()
    gc.disable()
    try:
        del simulation
        assert alive() is None
    finally:
        if was_enabled:
            gc.enable()


def test_a_tissue_in_another_process_cannot_be_reset_or_saved():
    scene = SCENES["slab"]
    with served(scene) as link:
        simulation = prepare(scene, link)
        for refused in (
            simulation.reset,
            simulation.save_state,
            lambda: simulation.observe(["points"]),
        ):
            with pytest.raises(StateError, match="run without --connect"):
                refused()
        assert simulation.observe(["force", "tetrahedra"])["tetrahedra"] > 0


def test_without_recording_frames_are_the_same_and_no_row_is_kept():
    recorded, bare = prepare(SCENES["slab"]), prepare(SCENES["slab"], records=False)
    bare._record = None  # type: ignore[method-assign]  # a call would fail
    for simulation in (recorded, bare):
        simulation.run(0.7)
    assert len(bare.recording) == 0 and bare.n_frames == recorded.n_frames == 700
    assert bare.result.cut_area == recorded.result.cut_area > 0.0
    assert np.array_equal(bare.wrench.force, recorded.wrench.force)


def test_without_recording_episodes_do_not_grow_memory():
    simulation = prepare(SCENES["slab"], records=False)

    def episode() -> int:
        simulation.reset()
        simulation.run(0.02)
        gc.collect()
        return tracemalloc.get_traced_memory()[0]

    tracemalloc.start()
    try:
        first, *_, last = [episode() for _ in range(12)][2:]
    finally:
        tracemalloc.stop()
    assert last < first + 50_000


def test_what_is_observed_is_what_is_recorded():
    simulation = prepare(SCENES["retract"])
    simulation.run(0.9)
    found = simulation.observe(QUANTITIES)
    recording = simulation.recording
    row = dict(zip(recording.columns, recording.rows[-1].tolist(), strict=True))
    assert found["time"] == row["time_s"] and found["cut_area"] == row["cut_area_m2"]
    assert found["left_opening"] == row["left_opening_m"]
    for name, unit in (("tip", "m"), ("force", "n"), ("left_force", "n")):
        assert found[name].tolist() == [row[f"{name}_{axis}_{unit}"] for axis in "xyz"]
    assert found["stiffness"].tolist()[:2] == [row["stiffness_xx_n_m"], row["stiffness_yy_n_m"]]


def test_before_the_first_frame_and_after_a_reset_the_same_is_observed():
    simulation = prepare(SCENES["slab"])
    names = ["tip", "force", "cut_area", "anchored_length", "surface", "points:16"]
    first = simulation.observe(names)
    assert not first["force"].any() and first["cut_area"] == first["anchored_length"] == 0.0
    assert not first["surface_is_cut"].any()
    simulation.run(0.7)
    assert simulation.observe(["surface"])["surface_is_cut"].any()
    simulation.reset()
    again = simulation.observe(names)
    assert again.keys() == first.keys()
    assert all(np.array_equal(first[name], again[name]) for name in first)


def test_material_points_stay_on_the_material_through_cuts_and_resets():
    simulation = prepare(SCENES["slab"])
    start = simulation.observe(["points:16"])["points:16"]
    frame, surface = simulation.frame, simulation.link.surface()
    skin = frame.points_to_world(surface.positions)
    apart = np.linalg.norm(start[:, None] - skin, axis=2).min(axis=1)
    assert start.shape == (16, 3) and apart.max() < 1e-9
    simulation.run(0.7)
    moved = simulation.observe(["points:16"])["points:16"]
    assert 1e-6 < np.linalg.norm(moved - start, axis=1).max() < 0.02
    simulation.reset()
    assert np.array_equal(simulation.observe(["points:16"])["points:16"], start)


def test_points_are_spread_as_far_apart_as_they_can_be():
    line = np.zeros((101, 3))
    line[:, 0] = np.linspace(0.0, 1.0, 101)
    assert sorted(farthest_points(line, 5)[:, 0]) == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    with pytest.raises(UsageError, match="1 to 101"):
        farthest_points(line, 102)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("tipp", "Did you mean 'tip'.*finished_area.*surface"),
        ("points:many", "as in 'points:64'"),
        ("surface:3", "observed whole"),
        ("tip:3", "no observation is called 'tip:3'"),
    ],
)
def test_a_wrong_name_of_an_observation_is_refused(name, said):
    with pytest.raises(UsageError, match=said):
        prepare(SCENES["slab"]).observe([name])
