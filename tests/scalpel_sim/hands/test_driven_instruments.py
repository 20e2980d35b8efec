"""A hand that leads a grasper and the blade in one run, whose record gives the same bits."""

from pathlib import Path

import numpy as np
import pytest

from scalpel_sim import prepare, read_scene
from scalpel_sim.arm.grasper import HALF_PAD
from scalpel_sim.errors import UsageError
from scalpel_sim.hands.commands import Choose, End, Engage, Jaws, Pause, Release, Undo
from scalpel_sim.hands.driven_instruments import JAW_SPEED
from scalpel_sim.hands.limited_pose import MOST_SPEED
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.runs.file_names import FINAL, SCENE, STROKE, grasp_file
from scalpel_sim.runs.run import REST_AFTER_STROKE
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.strokes.csv_lines import StrokeError
from scalpel_sim.strokes.grasp_motion import GRASP_COLUMNS, grasp_from_csv
from tests.scalpel_sim.hands.driven_runs import PERIOD, Clock, controls_of, done, led, move, turn
from tests.support.run_files import assert_same_run, untimed

SHEET = read_scene(Path(__file__).parent / "sheet.toml")

BLADE, GRASPER = 0, 1
"""Numbers of the instruments."""

"""Columns of `forces.csv` before wall times."""

DT = 1e-3
"""Length of a frame [s]."""

ROUNDING = 1e-9
"""By which a place may differ after it was turned into an edge and back [m]."""


def moves(first, last, x=0.0, y=0.0, z=0.0):
    """Return moves of a page from one frame to another, of so much in all [m]."""
    frames = range(first, last, PERIOD)
    n = len(frames)
    return [(frame, move(x / n, y / n, z / n)) for frame in frames]


LIFT_AND_CUT = sorted(
    [
        (0, Choose(GRASPER)),
        (0, Engage()),
        *moves(0, 200, y=-0.034),
        (300, Jaws(True)),
        *moves(620, 750, z=0.01),
        (760, turn(x=-0.1)),
        (850, Release()),
        (850, Choose(BLADE)),
        (850, Engage()),
        *moves(850, 1200, y=-0.035),
        (1250, Choose(GRASPER)),
        (1250, Jaws(False)),
        (1600, End()),
    ],
    key=lambda each: each[0],
)
"""What a person does to take the edge of the sheet, lift it, cut beside the jaws, and let it go."""


def doing(script, hand):
    """Return a callback that gives the commands of a script at their frames."""
    waiting = list(script)

    def command(simulation) -> None:
        while waiting and waiting[0][0] <= len(simulation.recording):
            hand.commands.append(waiting.pop(0)[1])

    return command


@pytest.fixture(scope="module")
def lifted(tmp_path_factory):
    """A run in which a hand lifts the sheet and cuts it, the hand, and the folder of its files."""
    folder = tmp_path_factory.mktemp("lifted")
    simulation, hand = led(SHEET)
    command = doing(LIFT_AND_CUT, hand)
    command(simulation)
    controls = controls_of(simulation, hand)
    done(simulation, folder, SHEET, every_frame=command, controls=controls)
    return simulation, hand, folder


def column(simulation, name):
    return simulation.recording.rows[:, simulation.recording.columns.index(name)]


def test_a_hand_grasps_the_edge_lifts_it_cuts_under_tension_and_lets_go(lifted):
    simulation, _, _ = lifted
    held, pull = column(simulation, "left_points"), -column(simulation, "left_force_z_n")
    assert held[250] == 0
    assert held[840] > 0
    assert pull[840] > 0.01, "the sheet pulls the jaws down"
    assert column(simulation, "cut_area_m2")[840] == 0.0
    assert column(simulation, "cut_area_m2")[1250] > 1e-4
    assert held[1240] > 0, "it is held while it is cut"
    assert held[1590] == 0
    assert simulation.time == pytest.approx(1.6 + REST_AFTER_STROKE, abs=2e-3)


def test_a_run_of_the_scene_that_it_wrote_repeats_it_to_the_bit(lifted, tmp_path):
    simulation, _, folder = lifted
    repeated = prepare(read_scene(folder / SCENE))
    done(repeated, tmp_path)
    assert len(repeated.recording) == len(simulation.recording)
    assert_same_run(folder, tmp_path)


def test_a_scripted_run_leaves_what_a_hand_did(lifted, tmp_path):
    _, _, folder = lifted
    assert read_scene(folder / SCENE).graspers[0].recorded == str(folder / grasp_file("left"))
    for name in (STROKE, grasp_file("left")):
        (tmp_path / name).write_bytes((folder / name).read_bytes())
    with Plotter() as plotter:
        Outputs(tmp_path, plotter).close()
    for name in (STROKE, grasp_file("left")):
        assert (tmp_path / name).read_bytes() == (folder / name).read_bytes()


@pytest.fixture(scope="module")
def at_start():
    return led(SHEET)


@pytest.fixture
def hand(at_start):
    """A hand at the start of the sheet."""
    hand = LiveHand(at_start[0], clock=Clock())
    hand.take_over(at_start[0])
    return hand


def rows_of(hand, n, first=0):
    """Return where blade and grasper are in `n` frames, and how far that is open."""
    blade, grasper, opening = [], [], []
    for k in range(first, first + n):
        hand.lead(k * DT)
        blade.append(hand.blade.pose.middle.copy())
        grasper.append(hand.graspers[0].pose.middle.copy())
        opening.append(hand.graspers[0]._at.opening)
    return np.array(blade), np.array(grasper), np.array(opening)


def test_moves_go_to_the_instrument_that_is_chosen_and_the_other_rests(hand):
    hand.commands += [Engage(), move(y=0.005)]
    blade, grasper, _ = rows_of(hand, 200)
    assert blade[-1, 1] - blade[0, 1] == pytest.approx(0.005, abs=1e-6)
    assert (grasper == grasper[0]).all()
    hand.commands += [Choose(GRASPER), Engage(), move(z=0.005), turn(z=0.1)]
    rested, (at_first,) = blade[-1], grasper[:1]
    blade, grasper, _ = rows_of(hand, 200, 200)
    assert (blade == rested).all()
    assert grasper[-1] - at_first == pytest.approx([0.0, 0.0, 0.005], abs=1e-6)


def test_another_choice_lets_go_first_and_nothing_jumps(hand):
    hand.commands += [Engage(), move(y=0.02)]
    before, *_ = rows_of(hand, 30)
    hand.commands += [Choose(GRASPER), move(y=0.02)]
    blade, grasper, _ = rows_of(hand, 50, 30)
    assert not hand.is_engaged
    assert (blade == before[-1]).all() and (grasper == grasper[0]).all()
    hand.commands += [Choose(BLADE), Engage()]
    assert (rows_of(hand, 50, 80)[0] == before[-1]).all()


def test_a_grasper_is_led_no_faster_than_a_blade_and_its_jaws_at_their_own_speed(hand):
    hand.commands += [Choose(GRASPER), Engage(), Jaws(True)]
    hand.commands += [move(y=-0.03)] * 2
    _, grasper, opening = rows_of(hand, 400)
    speeds = np.linalg.norm(np.diff(grasper, axis=0), axis=1) / DT
    assert speeds.max() == pytest.approx(MOST_SPEED)
    assert -np.diff(opening).min() / DT == pytest.approx(JAW_SPEED)
    assert opening[0] == 0.016 and opening[-1] == 0.007, "as far as its script closes them"
    hand.commands.append(Jaws(False))
    assert rows_of(hand, 400, 400)[2][-1] == 0.016


def test_the_blade_has_no_jaws_and_there_is_no_third_instrument(hand):
    hand.commands += [Jaws(True), Choose(2)]
    opening = rows_of(hand, 100)[2]
    assert (opening == opening[0]).all()
    assert hand.chosen == BLADE
    assert [each.is_closed for each in hand.instruments] == [None, False]


def test_the_grasper_stays_in_its_workspace(hand, at_start):
    workspace = at_start[0].graspers[0].workspace
    hand.commands += [Choose(GRASPER), Engage()]
    for k in range(1500):
        if k % 100 == 0:
            hand.commands.append(move(0.05, 0.05, 0.05))
        grasper = rows_of(hand, 1, k)[1]
    assert grasper[-1] == pytest.approx(workspace[1], abs=1e-6)


def test_a_state_saved_while_a_grasper_holds_brings_both_hands_back_to_the_bit():
    simulation, hand = led(SHEET)
    command = doing(LIFT_AND_CUT, hand)

    def go_on(n):
        for _ in range(n):
            command(simulation)
            simulation.step()

    def where():
        rows = untimed(simulation.recording)[700:]
        return rows, hand.chosen, [each.pose.wanted.copy() for each in hand.instruments]

    go_on(700)
    state = simulation.save_state()
    assert simulation.graspers[0].n_points > 0
    found = []
    for _ in range(2):
        command = doing([(700, Choose(BLADE)), (700, Engage()), *moves(700, 900, y=-0.03)], hand)
        go_on(300)
        found.append(where())
        simulation.load_state(state)
        assert hand.chosen == GRASPER
    (rows, chosen, wanted), (rows_again, chosen_again, wanted_again) = found
    assert np.array_equal(rows, rows_again, equal_nan=True)
    assert chosen == chosen_again
    assert np.array_equal(wanted, wanted_again)


def test_an_undo_takes_what_a_grasper_did_off_its_record(tmp_path):
    simulation, hand = led(SHEET)
    controls = controls_of(simulation, hand)
    undone = [(0, Choose(GRASPER)), (50, Engage()), *moves(50, 250, y=-0.034), (400, Undo())]
    kept = [(60, Choose(BLADE)), (60, Engage()), *moves(60, 300, y=-0.02), (350, End())]
    command = doing([*undone, *kept], controls)
    command(simulation)
    folder, again = tmp_path / "led", tmp_path / "again"
    done(simulation, folder, SHEET, every_frame=command, controls=controls)
    at = hand.graspers[0].pose.middle
    assert at == pytest.approx(SHEET.graspers[0].motion[0].at, abs=ROUNDING)
    assert len((folder / grasp_file("left")).read_text().splitlines()) < 10, "it rests all the time"
    repeated = prepare(read_scene(folder / SCENE))
    done(repeated, again)
    assert (folder / FINAL).read_bytes() == (again / FINAL).read_bytes()


def test_closed_jaws_are_undone_as_a_stroke_is():
    simulation, hand = led(SHEET)
    controls = controls_of(simulation, hand)
    controls.history.begin()

    def frames(*commands):
        controls.commands += commands
        for _ in range(200):
            controls.obey()
            simulation.step()

    frames(Choose(GRASPER))
    frames(Jaws(True))
    assert hand.graspers[0].is_closed
    controls.commands.append(Undo())
    controls.obey()
    assert not hand.graspers[0].is_closed
    assert len(simulation.recording) == 200
    assert hand.chosen == GRASPER


def test_a_choice_is_seen_while_time_stands_still():
    simulation, hand = led(SHEET)
    controls = controls_of(simulation, hand)
    controls.commands += [Pause(), Choose(GRASPER)]
    assert controls.obey()
    assert hand.chosen == GRASPER


HEADER = ",".join(GRASP_COLUMNS)
ROW = "0,0,0.07,0.004,0,-1,0,0,0,1,0.016,0"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", r"g\.csv is empty; its first line is t,x,y,z"),
        (f"{HEADER}\n0,1", r"g\.csv, line 2: 2 values, wanted 12"),
        (f"{HEADER}\n{ROW.replace('0.016', '0.5')}", r"line 2: opening is 0.5 m; it must lie bet"),
        (f"{HEADER}\n{ROW.replace('0,0,1', '0,1,0')}", r"line 2: .*must be two directions"),
        (f"{HEADER}\n{ROW}\n{ROW}", r"line 3: time 0 s follows 0 s; times must increase"),
        (f"{HEADER}\n{ROW}\n{ROW.replace('0,0,', '0.001,7,', 1)}", r"line 3: .* in metres\?"),
        (f"{HEADER}\n{ROW.replace('0,', '-1,', 1)}", r"line 2: time is -1 s"),
    ],
)
def test_a_file_that_no_grasper_can_follow_is_refused_by_line_and_reason(tmp_path, text, message):
    path = tmp_path / "g.csv"
    path.write_text(text)
    with pytest.raises(StrokeError, match=message):
        grasp_from_csv(path, "left")


def test_a_grasper_with_a_motion_and_a_recorded_one_is_refused(tmp_path):
    text = (Path(__file__).parent / "sheet.toml").read_text()
    path = tmp_path / "both.toml"
    path.write_text(text.replace('name = "left"', 'name = "left"\nrecorded = "g.csv"'))
    with pytest.raises(UsageError, match=r"has a motion and a recorded one; choose one"):
        read_scene(path)


def test_a_missing_file_of_a_grasper_is_named(tmp_path):
    with pytest.raises(StrokeError, match=r"cannot read the motion of grasper 'left' .*none\.csv"):
        grasp_from_csv(tmp_path / "none.csv", "left")


def test_a_recorded_grasper_is_where_its_rows_say_and_even_between_them(tmp_path):
    path = tmp_path / "g.csv"
    later = ROW.replace("0,0,0.07", "0.1,0,0.06").replace("0.016", "0.01")
    path.write_text(f"{HEADER}\n{ROW}\n{later}\n")
    motion = grasp_from_csv(path, "left")
    openings = [motion.opening(t) for t in (0.0, 0.05, 0.1, 1.0)]
    assert openings == pytest.approx([0.016, 0.013, 0.01, 0.01])
    pose = motion.stroke(HALF_PAD, HALF_PAD).pose(0.05)
    assert 0.5 * (pose.tip + pose.heel) == pytest.approx([0.0, 0.065, 0.004])
