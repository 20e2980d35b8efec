"""Variations of episodes are drawn by a seed, and gone with the next reset."""

import logging

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scalpel_sim import changed, read_scene
from scalpel_sim.errors import UsageError
from scalpel_sim.learning import Episode, Expert
from scalpel_sim.learning.line_motion import LineMotion
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.act_table import ActTable
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.scene.vary_table import VaryTable
from scalpel_sim.viewer.judged import plan_marks
from tests.scalpel_sim.learning.little_task import little_task

__all__ = ["little_task"]

RANGES = {
    "material.young_modulus": (0.8, 1.3),
    "material.toughness": (0.5, 2.0),
    "task.line.along": (-2e-3, 2e-3),
    "task.line.across": (-2e-3, 2e-3),
    "task.line.turn": (-12.0, 12.0),
    "start.x": (-3e-3, 3e-3),
    "start.z": (0.0, 2e-3),
}
AS_IT_IS = {name: float(name.startswith("material")) for name in RANGES}


def varied(scene, ranges):
    return changed(scene, vary=tuple(VaryTable(what=w, range=r) for w, r in ranges.items()))


@pytest.fixture(scope="module")
def episode(little_task):
    return Episode(varied(little_task, RANGES))


def begin(episode, seed=3, **numbers):
    given = AS_IT_IS | numbers
    return episode.reset(np.random.default_rng(seed), given if numbers else None)


def script(episode):
    """Do the script of the scene by actions."""
    expert = Expert(episode)
    for _ in range(400):
        outcome = episode.act(expert.action())
        if outcome.terminated or outcome.truncated:
            return outcome
    raise AssertionError("the episode does not end")


def acted(episode, n=12):
    rng, found = np.random.default_rng(1), list(episode.observation.values())
    for _ in range(n):
        episode.act(rng.uniform(-1.0, 1.0, len(episode.action_names)))
        found += episode.observation.values()
    return [each.tobytes() for each in found]


def test_a_seed_gives_the_same_numbers_and_the_same_bytes(episode):
    begin(episode)
    drawn, bytes_then = dict(episode.drawn), acted(episode)
    assert list(drawn) == list(RANGES)
    assert all(low <= drawn[name] <= high for name, (low, high) in RANGES.items())
    begin(episode, seed=4)
    assert all(episode.drawn[name] != drawn[name] for name in RANGES)
    acted(episode)
    begin(episode)
    assert episode.drawn == drawn
    assert acted(episode) == bytes_then
    episode.reset(np.random.default_rng(99), drawn)
    assert episode.drawn == drawn
    assert acted(episode) == bytes_then


def test_the_script_succeeds_wherever_the_line_lies(episode):
    lines = []
    for seed in range(2):
        begin(episode, seed)
        outcome = script(episode)
        assert episode.is_success, (seed, episode.drawn, outcome)
        lines.append(episode.score.plan.line)
    assert np.abs(lines[0][0] - lines[1][0]).max() > 1e-3


def test_twice_the_toughness_takes_twice_the_work_however_often_it_was_drawn(episode):
    per_area = {}
    for factor in (1.0, 2.0, 2.0, 1.0):
        begin(episode, **{"material.toughness": factor})
        script(episode)
        figures = episode.score.figures()
        now = figures["work_of_cutting_j"] / figures["terms"]["cut_area"]
        assert per_area.setdefault(factor, now) == now
    # The tougher body gives way more before it parts, so that not quite the same is swept.
    assert per_area[2.0] == pytest.approx(2.0 * per_area[1.0], rel=0.1)


def test_the_plan_and_what_is_shown_of_it_move_with_the_line(episode):
    length = np.hypot(0.02, 0.002)
    ahead, right = np.array([0.02, 0.002]) / length, np.array([0.002, -0.02]) / length
    observed = begin(episode, **{"task.line.along": 2e-3, "task.line.across": -1e-3})
    expected = np.array(episode.task.line) + 2e-3 * ahead - 1e-3 * right
    assert np.allclose(observed["target"][[0, -1], :2], expected, atol=2e-4)
    assert not episode.score.is_covered.any()
    turned = begin(episode, **{"task.line.turn": 12.0})["target"][[0, -1], :2]
    (x, y), angle = np.diff(turned, axis=0)[0], np.arctan2(0.002, 0.02)
    assert np.arctan2(y, x) == pytest.approx(angle - np.radians(12.0), abs=1e-3)  # from above
    assert np.allclose(turned.mean(0), np.mean(episode.task.line, axis=0), atol=1e-4)


def test_the_line_that_a_page_draws_moves_too(episode):
    lines = []
    for across in (0.0, -2e-3):
        begin(episode, **{"task.line.across": across})
        lines.append(plan_marks(episode.simulation).places)
    assert np.allclose((lines[1] - lines[0])[:, 1], 2e-3, atol=1e-4)


@pytest.mark.parametrize("arm", ["kinematic", "full"])
def test_a_hand_starts_elsewhere_and_its_way_begins_there(little_task, arm):
    episode = Episode(varied(little_task, {"start.x": RANGES["start.x"]}), arm)
    where = {x: episode.reset(np.random.default_rng(0), {"start.x": x}) for x in (0.0, 3e-3)}
    (x, y, z), (x0, y0, z0) = where[3e-3]["blade"][:3], where[0.0]["blade"][:3]
    within = 1e-6 if arm == "kinematic" else 5e-4  # an arm follows its hand
    assert (x - x0, y - y0, z - z0) == pytest.approx((3e-3, 0.0, 0.0), abs=within)
    assert episode.score.terms()["path_length"] < within


def test_the_errors_of_the_sensor_are_those_that_were_drawn(little_task):
    sensor = {"sensor.force": (0.0, 0.2), "sensor.torque": (0.0, 0.01), "sensor.delay": (0.0, 0.1)}
    episode = Episode(varied(little_task, sensor))
    episode.reset(np.random.default_rng(7))
    by_seed = acted(episode, 3)
    episode.reset(np.random.default_rng(7), dict(episode.drawn))
    assert acted(episode, 3) == by_seed
    drawn = {"sensor.force": 0.1, "sensor.torque": 0.004, "sensor.delay": 0.06}
    episode.reset(np.random.default_rng(0), drawn)
    shown = []
    for _ in range(200):  # in the air
        episode._observation = episode._observer.after_step(np.zeros(6), 0.0)
        shown.append(episode.observation["wrench"])
    assert np.std(shown, axis=0)[:3] == pytest.approx(3 * [0.1], rel=0.2)
    assert np.std(shown, axis=0)[3:] == pytest.approx(3 * [0.004], rel=0.2)
    episode.reset(np.random.default_rng(0), drawn | {"sensor.force": 0.0, "sensor.torque": 0.0})
    felt = np.arange(1.0, 7.0)
    forces = [episode._observer.after_step(felt, 0.0)["wrench"][0] for _ in range(5)]
    assert forces == [0.0, 0.0, 0.0, 1.0, 1.0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"start.q": 1.0}, "no number of .* is called 'start.q'. Did you mean 'start"),
        ({"start.x": 0.1}, r"start.x of the variation is 0.1; .* has -0.003 to 0.003"),
        ({"start.x": float("nan")}, "start.x of the variation is nan"),
    ],
)
def test_numbers_that_cannot_be_drawn_are_refused(episode, change, message):
    with pytest.raises(UsageError, match=message):
        episode.reset(np.random.default_rng(0), AS_IT_IS | change)
    with pytest.raises(UsageError, match=r"the variation has no start.z; it has all of"):
        rest = {name: number for name, number in AS_IT_IS.items() if name != "start.z"}
        episode.reset(np.random.default_rng(0), rest)


def test_a_line_that_would_leave_the_body_is_refused_at_once(little_task):
    scene = varied(little_task, {"task.line.across": (0.0, 0.02)})
    with pytest.raises(UsageError, match=r"with task.line.across 0.02: \[task\] line misses"):
        Episode(scene)


def test_a_range_that_makes_episodes_slow_is_warned_of(little_task, caplog):
    with caplog.at_level(logging.WARNING, "scalpel_sim"):
        Episode(varied(little_task, {"material.young_modulus": (1.0, 2.0)}))
        assert not caplog.records
        Episode(varied(little_task, {"material.young_modulus": (1.0, 4.0)}))
    assert "up to 2 times as many steps" in caplog.text


def test_a_hand_that_no_policy_leads_starts_where_it_does(little_task):
    row = VaryTable(what="start.x", hand="left", range=(0.0, 1e-3))
    assert changed(little_task, vary=(row,)).vary[0].name == "start.x:left"
    with pytest.raises(UsageError, match="no hand of a policy is called 'left'"):
        changed(little_task, vary=(row,), act=ActTable(hands=("blade",)))


PARTS = """
[body]
shape = "block"
size = [0.04, 0.02, 0.02]
cells = [4, 2, 2]

[material]
preset = "liver"

[[label]]
name = "fat"
region = "0,0,0:0.02,0.02,0.02"
material = { preset = "fat" }

[[label]]
name = "rest"
region = "0.02,0,0:0.04,0.02,0.02"

[[interface]]
between = ["fat", "rest"]
toughness = 20.0

[[stroke]]
kind = "traced"
points = [[0.01, 0.01, 0.02], [0.02, 0.01, 0.02]]
depth = 0.004

[task]

[[vary]]
what = "material.toughness"
range = [0.5, 2.0]

[[vary]]
what = "material.toughness"
label = "fat"
range = [0.5, 2.0]

[[vary]]
what = "interface.toughness"
between = ["rest", "fat"]
range = [0.5, 2.0]
"""


def test_factors_of_a_part_and_of_all_multiply_and_a_layer_has_its_own(tmp_path):
    path = tmp_path / "parts.toml"
    path.write_text(PARTS)
    episode = Episode(read_scene(path))
    episode.simulation.reset()  # nothing is varied then
    body = episode.simulation.link.tissue._stages.model.body
    before = dict(zip(body.materials.label.tolist(), body.materials.toughness, strict=True))
    drawn = {
        "material.toughness": 1.5,
        "material.toughness:fat": 0.8,
        "interface.toughness:fat+rest": 0.7,
    }
    for _ in range(2):
        episode.reset(np.random.default_rng(0), drawn)
        body = episode.simulation.link.tissue._stages.model.body
        now = dict(zip(body.materials.label.tolist(), body.materials.toughness, strict=True))
        names = episode.simulation.link.label_names
        ratios = {names[label]: now[label] / before[label] for label in now}
        assert ratios == pytest.approx({"fat": 1.2, "rest": 1.5})
        assert body.interfaces.toughness == pytest.approx([14.0])


@given(
    along=st.floats(-0.1, 0.1),
    across=st.floats(-0.1, 0.1),
    turn=st.floats(-180.0, 180.0),
    into=st.sampled_from([None, (0.0, 0.0, -2.0), (0.0, 3.0, 0.0), (1.0, 1.0, -1.0)]),
)
def test_a_line_moves_as_a_rigid_body_across_its_depth(along, across, turn, into, body_at_rest):
    corners = [(0.01, 0.02, 0.03), (0.03, 0.01, 0.03), (0.035, 0.04, 0.02)]
    motion = LineMotion(TaskTable(line=corners, depth=1e-3, into=into), body_at_rest)
    moved = np.array(motion.moved_task((along, across, turn)).line)
    rest, depth = np.array(corners), np.array(into or (0.0, 0.0, -1.0))
    np.testing.assert_allclose(moved @ depth, rest @ depth, atol=1e-12)
    for i, j in ((0, 1), (1, 2), (0, 2)):
        distance = np.linalg.norm(rest[i] - rest[j])
        assert np.linalg.norm(moved[i] - moved[j]) == pytest.approx(distance, abs=1e-12)
    shift = 0.5 * (moved[0] + moved[2] - rest[0] - rest[2])
    assert np.linalg.norm(shift) == pytest.approx(np.hypot(along, across), abs=1e-12)


@pytest.fixture(scope="module")
def body_at_rest(little_task):
    return make_tissue(little_task).snapshot()
