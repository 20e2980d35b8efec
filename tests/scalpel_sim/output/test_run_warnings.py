"""A run that did not do what it was asked says so at its end; one that did says nothing."""

import functools
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from scalpel_sim import Scene, StrokeTable, prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.output.run_outcome import outcome_of
from scalpel_sim.output.run_warnings import warnings_of
from scalpel_sim.recording.columns import columns_in, grasper_quantities, shared_columns
from scalpel_sim.recording.recording import Recording
from scalpel_sim.runs.run import run_time
from scalpel_sim.scene.body import GivenBody
from scalpel_sim.scene.scene import changed
from scalpel_sim.strokes.stroke import Stroke
from tests.scalpel_sim.served_scenes import served
from tissue import Material, block

GEL = Material(
    law="neo_hookean", young_modulus=30e3, poisson_ratio=0.45, toughness=20.0, friction=0.3
)
BLOCK = changed(
    Scene(
        name="block",
        about="a block of 30 x 30 x 20 mm",
        body=GivenBody(source=lambda: block((3, 3, 2), (0.03, 0.03, 0.02)), fixed="bottom"),
    ),
    material=GEL,
    audit=True,
)
FREE = changed(BLOCK, fixed="none", table=0.0)


def line(low, end=0.045, x=0.0155, **keys):
    """Return an upright edge whose tip is led along the block at a height [m]."""
    points = [[x, -0.008, low], [x, end, low]]
    return StrokeTable(kind="points", points=points, length=0.04, speed=0.2, **keys)


THROUGH, SLIT = line(-0.005), line(0.01)

OBEDIENT = {
    "clean through": changed(BLOCK, fixed="left,right", strokes=(THROUGH,)),
    "a slit that is cut twice": changed(BLOCK, strokes=(SLIT, SLIT)),
    "a slit that is made deeper": changed(BLOCK, strokes=(line(0.013), line(0.006))),
    "an incision in cells as large as it is deep": changed(
        BLOCK,
        mesh=lambda: block((6, 6, 4), (0.06, 0.06, 0.03)),
        strokes=(StrokeTable(kind="incision", speed=0.2),),
    ),
    "a stop inside": changed(BLOCK, strokes=(StrokeTable(kind="stop"),)),
    "a press": changed(BLOCK, strokes=(StrokeTable(kind="press"),)),
    "a stab": changed(
        BLOCK,
        strokes=(
            StrokeTable(
                kind="stab",
                points=[[0.0155, 0.0155, 0.025]],
                length=0.04,
                depth=0.012,
                forward=[0.0, 1.0, 0.0],
            ),
        ),
    ),
    "as long as was asked": changed(BLOCK, strokes=(THROUGH,), seconds=0.2),
}


def run(scene, link=None):
    """Do a run, and return what came of it."""
    simulation = prepare(scene, link)
    first, known = simulation.link.snapshot(), simulation.link.describe()
    simulation.run(run_time(simulation, scene.seconds))
    last, report = simulation.link.snapshot(), simulation.link.cut_report()
    return outcome_of(simulation, scene.settings(), known, first, last, report)


@functools.cache
def pushed():
    """Return the outcome of a blade that pushes a free block along a table."""
    return run(changed(FREE, strokes=(line(0.0),)))


def only_warning(outcome):
    (warning,) = warnings_of(outcome)
    return warning


def with_columns(recording, **changes):
    """Return a recording with numbers of some columns changed, row by row."""
    changed_one = Recording()
    for row in recording.rows.copy():
        for name, change in changes.items():
            row[shared_columns().index(name)] = change(row[shared_columns().index(name)])
        changed_one.append(row)
    return changed_one


@pytest.mark.parametrize("name", OBEDIENT)
def test_a_run_that_does_what_it_was_asked_ends_without_a_warning(name):
    assert warnings_of(run(OBEDIENT[name])) == []


def test_a_free_block_that_is_pushed_along_says_by_how_much_and_why():
    outcome = pushed()
    warning = only_warning(outcome)
    assert warning.kind == "unfinished_cut"
    figures = warning.figures
    assert figures["cut_area_m2"] == 0.0
    assert figures["asked_area_m2"] == pytest.approx(6e-4, rel=0.01)
    assert (figures["pieces"], figures["asked_pieces"]) == (1, 2)
    n = len(outcome.first.positions)  # nodes are appended
    moved = (outcome.last.positions[:n] - outcome.first.positions).mean(axis=0)
    assert figures["body_moved_m"] == pytest.approx(np.linalg.norm(moved), rel=0.05)
    # The blade presses on the block a little as well.
    assert figures["friction_of_table_n"] == pytest.approx(0.3 * 0.018 * 9.81, rel=0.3)
    assert figures["expected_force_n"] == pytest.approx(20.0 * 0.02, rel=0.01)
    for words in (
        r"0 of \d+ mm² \(0%\), and 1 piece is left where 2 were to be",
        r"the body has moved by \d\d\.?\d* mm",
        r"the edge went [\d.]+ mm forward with tissue on it and cut 0 mm",
        r"friction with the table holds it with 0\.0\d+ N, and the cut needs 0\.4 N",
    ):
        assert re.search(words, warning.message)


def test_an_arm_at_its_limit_is_a_reason():
    limited = replace(pushed(), counters={"force_limited": 12})
    assert "above the limit of the arm in 12 frames" in only_warning(limited).message


def test_enough_friction_is_not_a_reason():
    held = replace(pushed(), settings=pushed().settings | {"table_friction": 20.0})
    assert "friction" not in only_warning(held).message


def test_a_body_that_yields_on_a_small_support_tells_its_turn_and_what_the_blade_feels():
    small = "0.01,0.01,-0.001:0.02,0.02,0.001"
    tough = GEL.changed(young_modulus=5e3, toughness=60.0)
    warning = only_warning(run(changed(BLOCK, fixed=small, material=tough, strokes=(THROUGH,))))
    assert warning.kind == "unfinished_cut"
    assert warning.figures["body_turned_rad"] > 0.1
    assert warning.figures["supports_moved_m"] == 0.0
    assert re.search(r"turned by \d+ degrees, what holds it by 0 mm", warning.message)


def test_each_cut_of_several_is_judged_by_itself():
    outcome = run(changed(BLOCK, strokes=(line(0.01, x=0.0105), line(0.01, x=0.0205))))
    assert warnings_of(outcome) == []
    (_, first), (start, _) = outcome.asked_areas
    area = outcome.recording.column("cut_area_m2")[round(start / outcome.dt)]
    assert area == pytest.approx(first, rel=0.05)
    without_second = with_columns(outcome.recording, cut_area_m2=lambda each: min(each, area))
    warning = only_warning(replace(outcome, recording=without_second))
    assert warning.message.startswith("cut 2 of 2 is unfinished: 0 of ")
    assert warning.figures["cut"] == 2


def test_a_cut_of_the_whole_area_that_leaves_one_piece_is_told():
    outcome = run(OBEDIENT["clean through"])
    warning = only_warning(replace(outcome, last=outcome.first))
    assert warning.kind == "not_parted"
    assert warning.message.startswith("1 piece is left where 2 were to be; ")


def test_what_a_hand_did_is_what_was_asked():
    stroke = pushed().stroke
    times = stroke.times.tolist()
    led = Stroke(times, [stroke.pose(t) for t in times], asked=stroke.asked, is_led=True)
    assert warnings_of(replace(pushed(), stroke=led)) == []


def test_a_blade_that_does_not_get_out_says_with_how_much_force_it_is_inside():
    outcome = run(changed(BLOCK, strokes=(line(0.01, end=0.0302),)))
    warning = only_warning(outcome)
    assert warning.kind == "blade_inside"
    assert warning.figures["edge_inside_m"] == outcome.recording.at_end("anchored_length_m") > 0.0
    assert warning.figures["force_at_end_n"] > 0.1
    assert re.search(r"still in it, with [\d.]+ mm of its edge and 0\.\d+ N", warning.message)


def test_a_stroke_that_stops_in_a_body_it_pushed_away_cut_nothing():
    outcome = run(changed(FREE, table_friction=0.1, strokes=(StrokeTable(kind="stop"),)))
    assert only_warning(outcome).kind == "nothing_cut"


def test_a_blade_that_comes_when_the_body_has_fallen_never_touched_it():
    warning = only_warning(run(changed(BLOCK, fixed="none", strokes=(line(0.0, wait=0.3),))))
    assert warning.kind == "untouched"
    assert warning.figures["body_moved_m"] > 0.5
    assert re.search(r"never touched the tissue: the body has moved by [\d,]+ mm", warning.message)


def test_tissue_that_is_too_tough_for_its_stiffness_releases_energy():
    tough = GEL.changed(young_modulus=5e3, toughness=160.0)
    scene = changed(
        BLOCK, mesh=lambda: block((4, 6, 4), (0.04, 0.06, 0.04)), material=tough, gravity=0.0
    )
    points = [[0.021, -0.008, -0.01], [0.021, 0.1, -0.01]]
    through = StrokeTable(kind="points", points=points, length=0.07, speed=0.2)
    found = {
        warning.kind: warning for warning in warnings_of(run(changed(scene, strokes=(through,))))
    }
    figures = found["energy_released"].figures
    assert figures["released_j"] > 0.1 * figures["energy_j"]
    assert 0.0 < figures["from_tip_m"][1] < figures["to_tip_m"][1] < 0.1
    assert re.search(r"from 0\.\d+ s \(tip at 21\.\d, ", found["energy_released"].message)


def test_area_that_is_not_paid_for_is_told_with_its_place():
    outcome = run(OBEDIENT["clean through"])
    names = ("cutting_j", "work_of_blade_j", "released_j")
    free = with_columns(outcome.recording, **dict.fromkeys(names, lambda each: 0.0))
    warning = only_warning(replace(outcome, recording=free))
    assert warning.kind == "area_unpaid"
    assert warning.figures["unpaid_area_m2"] == pytest.approx(6e-4, rel=0.1)
    assert warning.figures["from_tip_m"][0] == pytest.approx(0.0155, abs=1e-3)


def test_the_toughness_at_speed_is_that_of_the_edge():
    faster = GEL.changed(toughness_exponent=0.5, toughness_speed=0.05)
    outcome = run(changed(BLOCK, material=faster, strokes=(SLIT,)))
    assert outcome.toughness.max() == pytest.approx(20.0 * (1.0 + 2.0), rel=0.01)


@pytest.mark.parametrize(
    ("points", "kinds"),
    [
        ([0, 0, 0, 0], ["empty_grasp"]),
        ([0, 9, 9, 9], []),
        ([0, 9, 0, 0], ["lost_grasp"]),
    ],
)
def test_a_grasper_that_holds_nothing_is_told(points, kinds):
    recording = Recording([*shared_columns(), *columns_in(grasper_quantities("left"))])
    for i, n in enumerate(points):
        recording.append([0.0] * len(shared_columns()) + [0.0] * 6 + [0.02 if i == 0 else 0.005, n])
    settings = {"graspers": [{"name": "left", "holds": "attachment"}]}
    outcome = replace(pushed(), recording=recording, settings=settings)
    assert [warning.kind for warning in warnings_of(outcome)] == kinds


def test_a_tissue_in_another_process_gives_the_warnings_without_what_is_not_known_there():
    with served(changed(FREE, strokes=(line(0.0),))) as link:
        there = run(changed(FREE, strokes=(line(0.0),)), link)
    unknown = ("fixed", "gravity", "attachments")
    known = {key: value for key, value in there.settings.items() if key not in unknown}
    warning, here = only_warning(replace(there, settings=known)), only_warning(pushed())
    assert here.message.startswith(warning.message)
    of_friction = here.figures.keys() - warning.figures.keys()
    assert of_friction == {"friction_of_table_n", "expected_force_n"}


PUSHED = """
[body]
shape = "block"
cells = [3, 3, 2]
size = [0.03, 0.03, 0.02]
fixed = "none"
[material]
law = "neo_hookean"
young_modulus = 30e3
poisson_ratio = 0.45
toughness = 20.0
[world]
table = 0.0
table_friction = 0.1
[[stroke]]
kind = "straight"
speed = 0.2
"""


@pytest.fixture
def scene_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pushed.toml").write_text(PUSHED)


def test_a_warning_is_on_standard_error_in_the_table_and_in_the_summary(scene_file, capsys):
    assert command_line(["run", "pushed.toml"]) == 0
    out, err = capsys.readouterr()
    with open("out/pushed/summary.json") as file:
        (warning,) = json.load(file)["warnings"]
    assert warning["kind"] == "unfinished_cut"
    assert f"warning: {warning['message']}" in err.splitlines()
    assert "unfinished_cut" in out and "the cut is unfinished: 0 of" in out
    assert warning["asked_area_m2"] == pytest.approx(6e-4, rel=0.02)


def test_strict_makes_a_warning_exit_code_4_and_is_nothing_to_a_run_without_one(scene_file, capsys):
    assert command_line(["run", "pushed.toml", "--strict", "-q"]) == 4
    (line,) = capsys.readouterr().err.splitlines()
    assert line == "error: the run ended with a warning, and --strict is given: unfinished_cut"
    assert command_line(["run", "pushed.toml", "--strict", "-q", "--seconds", "0.1"]) == 0
