"""Strokes that a force stops, and that end when the body is parted."""

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.guarded_follower import (
    AS_PLANNED,
    DREW_BACK,
    ENDED,
    GAVE_UP,
    STOPPED,
    THROUGH,
)
from scalpel_sim.output.run_outcome import outcome_of
from scalpel_sim.output.run_warnings import warnings_of
from scalpel_sim.runs.run import REST_AFTER_STROKE
from scalpel_sim.scene.scene import changed
from scalpel_sim.state import SimulationState
from scalpel_sim.strokes.kind import StrokeTable
from tissue import MATERIALS, BladeShape, block

GRID2 = SCENES["grid2"]
LIMIT = 0.1
"""Below the peak of 0.3 N of the straight stroke through this block [N]."""


GELATIN = changed(
    GRID2,
    mesh=lambda: block((6, 4, 3), (0.06, 0.04, 0.03)),
    material=MATERIALS["gelatin"].material,
    blade=BladeShape(),
    stretch=0.05,
)
"""A block that the blade parts with 0.2 N in the mean, and 0.6 N at most."""

LIMIT_OF_GELATIN = 0.3
"""[N]."""


def with_strokes(*rows, **changes):
    return changed(GRID2, strokes=tuple(StrokeTable(**row) for row in rows), **changes)


def done(scene, seconds=None):
    simulation = prepare(scene)
    seconds = simulation.duration + REST_AFTER_STROKE if seconds is None else seconds
    simulation.run(seconds, has_ended)
    return simulation


def has_ended(simulation):
    progress = simulation.blade.progress
    return progress is not None and progress.mode == ENDED


def how_ended(simulation):
    return [end.how for end in simulation.blade.progress.ends]


def column(simulation, name):
    return simulation.recording.column(name)


def test_a_limit_that_is_not_reached_changes_no_bit():
    free, guarded = done(GRID2), done(with_strokes({"force_limit": 1e3}))
    n = min(len(free.recording), len(guarded.recording))
    for name in ("tip_y_m", "force_y_n", "cut_area_m2"):
        assert np.array_equal(column(free, name)[:n], column(guarded, name)[:n])
    assert column(guarded, "cut_area_m2")[-1] > 0.0
    assert how_ended(guarded) == [AS_PLANNED]


def test_a_stroke_stops_at_its_limit_with_all_that_was_to_come():
    row = {"force_limit": LIMIT}
    simulation = done(with_strokes(row, row))
    force, clock = simulation.recording.sizes("force"), column(simulation, "stroke_time_s")
    first = int(np.argmax(force > LIMIT))
    assert how_ended(simulation) == [STOPPED]
    assert simulation.duration == pytest.approx((first + 1) * simulation.dt)
    simulation.run(simulation.time + 0.1)
    assert clock[-1] == column(simulation, "stroke_time_s")[-1]


def test_a_blade_that_is_drawn_back_is_where_it_began_and_does_the_next_stroke():
    row = {"kind": "press", "depth": 0.01, "force_limit": LIMIT, "at_limit": "draw back"}
    simulation = done(with_strokes({**row, "pause": 0.1}, {"kind": "press", "depth": 0.001}))
    assert how_ended(simulation) == [DREW_BACK, AS_PLANNED]
    back = simulation.stroke.guards[0].begin
    frames = np.flatnonzero(column(simulation, "stroke_time_s") == back)
    rested = frames[frames > 100]
    there = 2.0 * simulation.blade.progress.ends[0].time  # as long back as forth
    assert rested[0] * simulation.dt == pytest.approx(there, abs=2.0 * simulation.dt)
    tip = simulation.recording.vector("tip")[rested[90]]
    begun = simulation.frame.segment_to_world(simulation.stroke.pose(back)).tip
    assert np.linalg.norm(tip - begun) < 1e-3  # what the hand yields
    assert simulation.recording.sizes("force")[rested[-1] :].max() > 0.0  # the other one


def test_a_stroke_that_waits_stands_while_the_force_is_above_its_limit_and_goes_through():
    row = StrokeTable(force_limit=LIMIT_OF_GELATIN, at_limit="wait", patience=10.0)
    simulation = done(changed(GELATIN, strokes=(row,)))
    clock, force = column(simulation, "stroke_time_s"), simulation.recording.sizes("force")
    moved = np.diff(clock)
    within = np.flatnonzero(clock[1:] < simulation.stroke.guards[0].end)
    is_over = force[:-1][within] > LIMIT_OF_GELATIN
    assert is_over.sum() > 100
    assert (moved[within][is_over] == 0.0).all()
    assert (moved[within][force[:-1][within] < 0.79 * LIMIT_OF_GELATIN] > 0.0).all()
    assert how_ended(simulation) == [AS_PLANNED]
    assert simulation.link.n_pieces() == 2
    assert simulation.duration > 1.2 * simulation.stroke.duration


def test_patience_ends_and_is_said():
    row = {"force_limit": 0.5 * LIMIT, "at_limit": "wait", "patience": 0.05}
    simulation = done(with_strokes(row))
    assert how_ended(simulation) == [GAVE_UP]
    (warning,) = [each for each in found_in(simulation) if each.kind == "gave_up"]
    assert "stroke 1, straight, waited for the force to fall below 0.05 N" in warning.message


def found_in(simulation):
    link = simulation.link
    ends = (link.describe(), prepare(GRID2).link.snapshot(), link.snapshot(), link.cut_report())
    strokes = [{"kind": "straight"} for _ in simulation.stroke.guards]
    return warnings_of(outcome_of(simulation, {"strokes": strokes}, *ends))


def test_a_stroke_until_through_ends_when_the_body_is_parted():
    simulation = done(with_strokes({"until": "through", "at_most": 0.02}))
    assert how_ended(simulation) == [THROUGH]
    assert simulation.link.n_pieces() == 2
    assert simulation.duration < done(GRID2).time
    assert [each.kind for each in found_in(simulation)] == []


def test_a_stroke_that_is_not_through_is_warned_of_and_went_as_far_as_it_may():
    rows = {"kind": "points", "points": [[0.02, -0.01, -0.05], [0.02, 0.01, -0.05]]}
    rows |= {"length": 0.2, "until": "through", "at_most": 0.01, "forward": [0.0, 1.0, 0.0]}
    simulation = done(with_strokes(rows))
    assert how_ended(simulation) == [AS_PLANNED]
    end = simulation.stroke.pose(simulation.stroke.duration).tip
    np.testing.assert_allclose(end, [0.02, 0.02, -0.05], atol=1e-9)
    assert "not_through" in [each.kind for each in found_in(simulation)]


@pytest.mark.parametrize("at", [0.25, 0.45, 0.9])
def test_a_state_is_gone_on_from_to_the_bit_in_each_mode(at):
    row = {"kind": "press", "depth": 0.01, "force_limit": LIMIT, "at_limit": "draw back"}
    scene = with_strokes({**row, "pause": 0.05}, {"force_limit": LIMIT, "at_limit": "wait"})
    one, other = prepare(scene), prepare(scene)
    one.run(at)
    state = one.save_state().to_bytes()
    one.run(at + 0.4)
    other.records = False
    other.load_state(SimulationState.from_bytes(state))
    other.run(at + 0.4)
    assert one.blade.progress.mode == other.blade.progress.mode
    assert one.blade.segment.numbers == other.blade.segment.numbers
    assert one.wrench.numbers == other.wrench.numbers


@pytest.mark.parametrize(
    ("row", "why"),
    [
        ({"at_limit": "stop"}, "has at_limit and no force_limit"),
        ({"force_limit": 1.0, "patience": 1.0}, 'it is for at_limit = "wait"'),
        ({"at_most": 0.1}, 'it is for until = "through"'),
        ({"kind": "press", "until": "through"}, 'of kind "press" has the key until'),
    ],
)
def test_keys_that_make_no_sense_together_are_refused(row, why):
    with pytest.raises(UsageError, match=why):
        with_strokes(row)
