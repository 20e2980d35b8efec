"""The score of whole simulations: what gains nothing, what has the same bits, and success."""

import json

import pytest
from msgspec import structs

from scalpel_sim import (
    SCENES,
    GrasperTable,
    SimulationState,
    StrokeTable,
    WaypointTable,
    prepare,
)
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.task_table import LimitTable, SpareTable, SuccessTable, TaskTable
from scalpel_sim.strokes.scene_stroke import stroke_through
from tests.scalpel_sim.scene.test_several_bodies import EXAMPLE
from tissue import TetrahedralMesh

TASK = TaskTable(
    line=[(0.02, 0.001), (0.02, 0.059)],
    depth=0.02,
    limits=(LimitTable(strain=0.2), LimitTable(instrument="blade", force=0.5)),
    success=SuccessTable(covered=0.95, off_plan=1e-6, force=5.0, depth_error=1e-3),
)
"""A cut of half the depth along the middle of the slab."""
ALONG = {"points": [(0.02, -0.03, 0.02), (0.02, 0.07, 0.02)], "length": 0.03}


def slab(task=TASK, **changes):
    """Return the slab with a task, and other tables of its scene."""
    return structs.replace(SCENES["slab"], task=task, **changes)


def done(scene, seconds=None, stroke=None):
    """Return the score of a scene that was done, or of a stroke in place of its own."""
    simulation = prepare(scene, records=False)
    if stroke is not None:
        body = simulation.link.snapshot()
        mesh = TetrahedralMesh(body.positions, body.tetrahedra)
        simulation.stroke = stroke_through(mesh, [stroke])
    simulation.run(seconds or simulation.duration + 0.1)
    assert simulation.score is not None
    simulation.score.look(simulation)
    return simulation.score


def test_the_planned_cut_succeeds():
    score = done(slab(strokes=(StrokeTable(kind="points", **ALONG),)))
    terms = score.terms()
    assert score.failed() == []
    assert terms["covered"] > 0.98
    assert terms["off_plan"] == 0.0
    assert terms["force"] > 0.2
    assert terms["work"] > 0.0


def test_pressing_without_cutting_gains_nothing():
    score = done(slab(strokes=(StrokeTable(kind="press", depth=0.0005),)))
    terms = score.terms()
    assert terms["covered"] == terms["off_plan"] == terms["cut_area"] == 0.0
    assert terms["depth_error"] == pytest.approx(0.02, rel=0.01)
    assert terms["force"] > 0.05
    assert terms["impulse"] > 0.0
    assert score.failed() == ["covered", "depth_error"]


def test_shaking_gains_nothing():
    """The blade goes back and forth over the plan, in the air above it."""
    start = ALONG["points"][0]
    over = [start, (0.02, -0.02, 0.05), (0.02, 0.06, 0.05)]
    led = StrokeTable(kind="points", points=over, length=0.03)
    shaken = structs.replace(led, saw_amplitude=0.004, saw_frequency=8.0)
    scene = slab(strokes=(StrokeTable(kind="points", **ALONG),))
    terms, still = (done(scene, stroke=each).terms() for each in (shaken, led))
    assert terms["covered"] == terms["cut_area"] == terms["force"] == 0.0
    assert terms["jerk"] > 10.0 * still["jerk"]
    assert terms["path_length"] > 2.0 * still["path_length"]


def on_skin(depth, **motion):
    """Return a stroke over the plan with the edge along the skin, pressed down by a depth."""
    edge = {"length": 0.03, "edge": (0.0, 1.0, 0.0), "forward": (0.0, 0.0, -1.0)}
    low = (0.02, 0.03, 0.04 - depth)
    return StrokeTable(**({"kind": "points", "points": [(0.02, 0.03, 0.045), low]} | edge | motion))


def test_shaking_in_contact_gains_nothing():
    """The edge is pressed 3 mm down over the plan, and goes to and fro across it."""
    swings = [(0.02 + 0.001 * (-1) ** i, 0.03, 0.037) for i in range(20)]
    shaken = on_skin(0.003, points=[(0.02, 0.03, 0.045), *swings], speed=0.1)
    terms, still = (done(slab(strokes=(each,))).terms() for each in (shaken, on_skin(0.003)))
    assert terms["covered"] == terms["off_plan"] == terms["cut_area"] == 0.0
    assert terms["force"] > 0.2
    assert terms["impulse"] > 1.5 * still["impulse"]
    assert terms["path_length"] > 1.5 * still["path_length"]


def test_what_is_cut_by_shaking_along_the_edge_is_paid_for():
    sawn = on_skin(0.005, speed=0.01, saw_amplitude=0.004, saw_frequency=8.0)
    terms = done(slab(strokes=(sawn,))).terms()
    assert 0.0 < terms["covered"] < 0.3
    assert terms["work"] > SCENES["slab"].material.toughness * terms["cut_area"]


def test_shaking_in_a_cut_covers_no_more_than_the_blade_has_reached():
    """The blade stops halfway, and goes to and fro by 4 mm in what it has cut."""
    straight = {"kind": "points", "length": 0.03, "forward": (0.0, 1.0, 0.0), "edge": (0, 0, 1)}
    half = 0.03
    ends = [(0.02, -0.03, 0.02), (0.02, half, 0.02)]
    to_and_fro = [(0.02, half - back, 0.02) for _ in range(5) for back in (0.004, 0.0)]
    scene = slab(strokes=(StrokeTable(kind="points", **ALONG),))
    once = done(scene, stroke=StrokeTable(**straight, points=ends)).terms()
    shaken = done(scene, stroke=StrokeTable(**straight, points=[*ends, *to_and_fro])).terms()
    reached = (half + TASK.tolerance - 0.001) / 0.058  # of the line, which begins at 1 mm
    assert 0.4 < once["covered"] <= shaken["covered"] <= reached
    assert shaken["cut_area"] <= half * 0.02
    assert shaken["off_plan"] == 0.0
    assert shaken["path_length"] > once["path_length"] + 0.03
    assert shaken["impulse"] > 1.5 * once["impulse"]


def test_tearing_gains_nothing():
    """A grasper pulls at the lobe of `retract` until the tissue slips out of its jaws."""
    (grasper,) = SCENES["retract"].graspers
    away = (0.15, 0.03, 0.07)
    torn = structs.replace(
        grasper,
        breaks_at=0.6,
        motion=[*grasper.motion[:3], WaypointTable(time=1.8, at=away)],
    )
    task = TaskTable(
        line=[(0.06, 0.01), (0.06, 0.05)],
        depth=0.005,
        limits=(LimitTable(strain=0.2), LimitTable(instrument="left", force=0.2)),
        success=SuccessTable(covered=0.5, strain_above=0.0),
    )
    scene = structs.replace(SCENES["retract"], task=task, graspers=(torn,))
    score = done(scene, seconds=1.9)  # before the blade has come
    terms = score.terms()
    assert terms["covered"] == terms["cut_area"] == 0.0
    assert terms["strain_above"] > 1e-8
    assert terms["left_dropped"] == 1.0
    assert 0.0 < terms["left_held"] < 0.8
    assert terms["force_above"] > 0.1
    assert score.failed() == ["covered", "strain_above"]


def test_held_is_the_share_of_the_cut_that_was_made_while_the_grasper_held():
    """The jaws close on a corner of the slab when a part of the cut is made already."""
    at = (0.004, 0.056, 0.02)
    motion = [
        WaypointTable(time=0.0, at=at, approach=(0, -1, 0), across=(0, 0, 1), opening=0.05),
        WaypointTable(time=1.0),
        WaypointTable(time=1.2, opening=0.037),
    ]
    task = TaskTable(**{"line": TASK.line, "depth": 0.02, "success": SuccessTable(held=0.9)})
    scene = slab(
        task,
        strokes=(StrokeTable(kind="points", **ALONG),),
        graspers=(GrasperTable(name="left", motion=motion),),
    )
    simulation = prepare(scene, records=False, frame_seconds=0.02)
    score, (left,) = simulation.score, simulation.graspers
    held = area = 0.0
    while simulation.time < simulation.duration:
        simulation.step()
        opened, area = simulation.result.cut_area - area, simulation.result.cut_area
        held += opened * left.holds
    assert 0.2 < held / area < 0.8
    assert score.terms()["held"] == pytest.approx(held / area, abs=1e-3)
    assert score.failed() == ["held"]


def test_a_scene_of_several_bodies_is_scored_as_one(tmp_path):
    """The example of the page: a cut parts the muscle and the fat on it, beside a vessel."""
    path = tmp_path / "scene.toml"
    path.write_text(EXAMPLE, "utf-8")
    task = TaskTable(kind="excise", target="fat", spare=(SpareTable(label="muscle/vessel"),))
    score = done(structs.replace(read_scene(path), task=task))
    terms, figures = score.terms(), score.figures()
    muscle, fat = 0.04 * 0.008, 0.035 * 0.006
    assert figures["planned_area_m2"] == pytest.approx(muscle + fat, rel=0.02)
    assert terms["covered"] > 0.95
    assert terms["cut_area"] == pytest.approx(muscle + fat, rel=0.05)
    assert terms["pieces"] == 4.0
    assert terms["removed"] == pytest.approx(0.5, abs=0.06)
    assert terms["healthy"] == pytest.approx(0.5 * 0.05 * muscle, rel=0.12)
    assert terms["spared"] == 1.0
    assert terms["spared_distance"] == pytest.approx(0.01, abs=2e-4)  # cells are 5 mm wide


@pytest.fixture(scope="module")
def whole():
    """Return a scene, the figures of its score at the end, and a state in its middle, as bytes."""
    scene = slab()
    simulation = prepare(scene, records=False)
    half = simulation.duration / 2.0
    simulation.run(half)
    state = simulation.save_state()
    simulation.run(simulation.duration)
    return scene, simulation, state, state.to_bytes(), repr(simulation.score.figures())


def test_the_figures_are_plain_numbers(whole):
    figures = whole[1].score.figures()
    again = json.loads(json.dumps(figures))
    assert again["terms"]["covered"] > 0.9
    assert again["instruments"][0]["name"] == "blade"
    assert again["asked"]["covered"] == 0.95


def test_a_state_that_is_loaded_scores_the_same_bits(whole):
    _, simulation, state, _, figures = whole
    for _ in range(2):
        simulation.load_state(state)
        assert repr(simulation.score.figures()) != figures
        simulation.run(simulation.duration)
        assert repr(simulation.score.figures()) == figures


def test_a_state_from_bytes_scores_the_same_bits(whole):
    scene, _, _, state, figures = whole
    simulation = prepare(scene, records=False)
    simulation.load_state(SimulationState.from_bytes(state))
    simulation.run(simulation.duration)
    assert repr(simulation.score.figures()) == figures
    simulation.reset()
    assert simulation.score.terms()["covered"] == 0.0


def test_two_threads_score_the_same_bits(whole):
    scene, *_, figures = whole
    shared = structs.replace(scene, solver=structs.replace(scene.solver, threads=2))
    simulation = prepare(shared, records=False)
    simulation.run(simulation.duration)
    assert repr(simulation.score.figures()) == figures


def test_a_scene_without_a_task_has_no_score():
    assert prepare(SCENES["slab"], records=False).score is None


@pytest.mark.parametrize(
    ("task", "message"),
    [
        (TaskTable(spare=(SpareTable(label="vessel"),)), "the body has no"),
        (TaskTable(target="vessel"), r"\[task\] target names 'vessel'"),
        (TaskTable(line=[(0.0, 0.1), (0.02, 0.1)], depth=0.01), "line misses the body"),
    ],
)
def test_a_task_that_does_not_fit_the_body_is_refused(task, message):
    with pytest.raises(UsageError, match=message):
        prepare(slab(task))


def test_success_of_a_plan_needs_one():
    stab = StrokeTable(
        kind="stab", points=[(0.02, 0.03, 0.05)], length=0.03, depth=0.02, forward=(0.0, 1.0, 0.0)
    )
    task = TaskTable(success=SuccessTable(covered=0.5))
    with pytest.raises(UsageError, match="success has covered, and there is no plan"):
        prepare(slab(task, strokes=(stab,)))


def test_a_task_that_took_too_long_has_failed():
    task = structs.replace(TASK, success=SuccessTable(), seconds=0.5)
    assert done(slab(task)).failed() == ["seconds"]
