import json

import numpy as np
import pytest

from scalpel_sim import prepare
from scalpel_sim.hands.commands import End, Engage, Pause, Release, Reset, Resume, Step, Undo
from scalpel_sim.hands.run_controls import FRAMES_PER_STEP
from scalpel_sim.runs.file_names import REPLAY, STROKE, SUMMARY
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.hands.driven_runs import GRID2, controls_of, done, led, move
from tests.support.run_files import assert_same_run

SCENE = changed(GRID2, relaxation="verlet")


@pytest.fixture
def run():
    """A run at its start, its hand, and its controls."""
    simulation, hand = led(SCENE)
    controls = controls_of(simulation, hand)
    controls.history.begin()
    return simulation, hand, controls


def frames(run, n, *commands):
    """Do `n` frames after some commands."""
    simulation, _, controls = run
    controls.commands += commands
    for _ in range(n):
        assert not controls.obey()
        simulation.step()


def stroke(run, *, way):
    """Cut a little way and let go."""
    frames(run, 150, Engage(), move(y=way))
    frames(run, 20, Release())


def body(simulation):
    """Return the bytes of the body, its connections too."""
    found = simulation.link.snapshot()
    return found.positions.tobytes(), found.velocities.tobytes(), found.tetrahedra.tobytes()


def test_an_undone_cut_leaves_the_body_the_arm_and_the_record_as_they_were_to_the_bit(run):
    simulation, hand, controls = run
    stroke(run, way=0.02)
    before, joints = body(simulation), simulation.arm.data.qpos.tobytes()
    rows, area = simulation.recording.rows.tobytes(), simulation.result.cut_area
    stroke(run, way=0.02)
    assert simulation.result.cut_area > area
    controls.commands.append(Undo())
    controls.obey()
    assert body(simulation) == before
    assert simulation.arm.data.qpos.tobytes() == joints
    assert simulation.recording.rows.tobytes() == rows
    assert simulation.result.cut_area == area
    assert not hand.is_engaged


def test_strokes_are_undone_one_by_one_and_a_reset_goes_to_the_start(run):
    simulation, _, controls = run
    start = body(simulation)
    ends = []
    for _ in range(3):
        ends.append(body(simulation))
        stroke(run, way=0.01)
    for end in reversed(ends[1:]):
        controls.commands.append(Undo())
        controls.obey()
        assert body(simulation) == end
    controls.commands.append(Reset())
    controls.obey()
    assert body(simulation) == start
    assert simulation.time == 0.0 and controls.history.n_strokes == 0


def test_taking_hold_without_moving_is_no_stroke(run):
    simulation, _, controls = run
    start = body(simulation)
    stroke(run, way=0.02)
    for _ in range(5):
        frames(run, 10, Engage())
        frames(run, 10, Release())
    controls.commands.append(Undo())
    controls.obey()
    assert body(simulation) == start


def test_an_undo_without_a_stroke_changes_nothing(run):
    simulation, _, controls = run
    frames(run, 10)
    before = body(simulation)
    controls.commands.append(Undo())
    controls.obey()
    assert body(simulation) == before


def test_what_was_undone_is_in_no_file_and_a_run_of_the_record_has_the_same_bits(tmp_path):
    simulation, hand = led(SCENE)
    controls = controls_of(simulation, hand)
    script = [
        (0, [Engage(), move(y=0.03)]),
        (200, [Release()]),
        (230, [Engage(), move(x=0.01, y=0.03)]),
        (400, [Undo()]),  # back to 230
        (260, [Engage(), move(x=-0.005, y=0.03)]),
        (500, [End()]),
    ]

    def every_frame(now):
        if script and len(now.recording) == script[0][0]:
            controls.commands += script.pop(0)[1]

    controls.commands += script.pop(0)[1]
    driven_folder, again = tmp_path / "led", tmp_path / "again"
    done(simulation, driven_folder, every_frame=every_frame, controls=controls)
    repeated = prepare(changed(SCENE, stroke=str(driven_folder / STROKE)))
    done(repeated, again)
    assert_same_run(driven_folder, again)
    times = np.loadtxt(driven_folder / STROKE, delimiter=",", skiprows=1)[:, 0]
    assert (np.diff(times) > 0.0).all() and not script
    assert (driven_folder / REPLAY).read_text().count('class="packet"') > 10
    assert json.loads((driven_folder / SUMMARY).read_text())["status"] == "complete"


def test_time_stands_still_and_goes_on_by_steps(run):
    simulation, _, controls = run
    frames(run, 5)
    controls.commands.append(Pause())
    assert controls.obey() and controls.obey()
    controls.commands.append(Step())
    done_frames = 0
    while not controls.obey():
        simulation.step()
        done_frames += 1
    assert done_frames == FRAMES_PER_STEP
    controls.commands.append(Resume())
    assert not controls.obey()


def test_the_blade_does_not_go_on_where_it_was_led_before_time_stood_still(run):
    _, hand, controls = run
    frames(run, 20, Engage(), move(y=0.03))
    before = hand.numbers
    controls.commands.append(Pause())
    controls.obey()
    frames(run, 50, Resume())
    assert hand.numbers == before


def test_a_run_that_stands_still_can_be_ended(run):
    _, hand, controls = run
    frames(run, 5)
    controls.commands += [Pause(), End()]
    frames(run, 1)
    assert hand.ended_at is not None
