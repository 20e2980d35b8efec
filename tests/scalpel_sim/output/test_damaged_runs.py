"""A run whose files were damaged after it was killed ends as one that was never killed."""

from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.errors import UsageError
from scalpel_sim.runs.checkpoints import read_checkpoint
from scalpel_sim.runs.file_names import (
    CHECKPOINT_FILES,
    FINAL,
    FORCES,
    INITIAL,
    JOURNAL,
    REPLAY,
    REPLAY_FRAMES,
    SCENE,
    STROKE,
)
from scalpel_sim.runs.resumption import CHANGED_SCENE, resumption_of
from scalpel_sim.runs.run_folder import Outputs
from tests.scalpel_sim.output.killed_runs import (
    Killed,
    change,
    checkpoints,
    copied,
    damaged_at_random,
    expect_same,
    half,
    killed_in,
    led,
    nothing,
    physics,
    resuming,
    run_in,
    with_bits,
    with_cell,
    with_noise,
    with_rows,
)

pytestmark = pytest.mark.end_to_end

WRONG = "9.75"
"""A number that no row holds."""


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    run_in(folder)
    return folder


@pytest.fixture(scope="module")
def killed(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("killed")
    killed_in(folder)
    return folder


@pytest.fixture(scope="module")
def resume():
    with resuming() as go_on:
        yield go_on


@pytest.fixture(scope="module")
def led_killed(tmp_path_factory) -> Path:
    """A run that a hand led, and that was killed."""
    folder = tmp_path_factory.mktemp("led")
    led(folder, 330)
    return folder


@pytest.fixture
def folder(tmp_path, killed) -> Path:
    return copied(killed, tmp_path / "run")


@pytest.fixture
def driven_folder(tmp_path, led_killed) -> Path:
    return copied(led_killed, tmp_path / "run")


def both(one, other):
    """Return what does two damages."""
    return lambda data: other(one(data))


FORCES_DAMAGES = {
    "numbers of row 60": both(with_cell(60, "force_x_n", WRONG), with_cell(60, "frame_s", WRONG)),
    "no number": with_cell(60, "force_x_n", "word"),
    "a row removed": with_rows(lambda rows: rows[:60] + rows[61:]),
}
REPLAY_DAMAGES = {
    "one bit": with_bits(1),
    "cut short": half,
}


@pytest.mark.parametrize("name", FORCES_DAMAGES)
def test_no_damage_of_the_rows_is_kept(name, folder, whole, resume, caplog):
    change(folder / FORCES, FORCES_DAMAGES[name])
    resume(folder)
    expect_same(folder, whole)
    assert WRONG not in (folder / FORCES).read_text().replace("\n", ",").split(",")
    assert f"{FORCES}: what follows after frame" in caplog.text


@pytest.mark.parametrize("name", REPLAY_DAMAGES)
def test_no_damage_of_the_replay_is_kept(name, folder, whole, resume, caplog):
    change(folder / REPLAY_FRAMES, REPLAY_DAMAGES[name])
    resume(folder)
    expect_same(folder, whole)
    assert f"is left out, since {REPLAY_FRAMES} was changed, damaged or removed" in caplog.text


@pytest.mark.parametrize("names", [(FORCES,), (REPLAY_FRAMES,), (JOURNAL, SCENE, INITIAL)])
def test_a_file_that_was_removed_is_made_again(names, folder, whole, resume):
    for name in names:
        (folder / name).unlink()
    resume(folder)
    expect_same(folder, whole)


def test_a_replay_that_was_damaged_late_costs_no_more_than_the_last_checkpoint(folder):
    n_bytes = read_checkpoint(checkpoints(folder)[1]).mark.written[REPLAY_FRAMES].n_bytes
    change(folder / REPLAY_FRAMES, lambda data: data[:n_bytes] + bytes(len(data) - n_bytes))
    assert resumption_of(folder).n_frames == 160


def test_rows_that_were_damaged_after_the_last_checkpoint_do_not_cost_it(folder):
    change(folder / FORCES, with_cell(-1, "tip_x_m", WRONG))
    found = resumption_of(folder)
    assert (found.n_frames, len(found.recorded)) == (200, 200)


@pytest.mark.parametrize("n", [1, 2])
def test_no_damage_of_checkpoints_is_kept(n, folder, whole, resume, caplog):
    damaged = checkpoints(folder)[:n]
    for path, damage in zip(damaged, (with_bits(1), half), strict=False):
        change(path, damage)
    resume(folder)
    expect_same(folder, whole)
    for path in damaged:
        assert f"{path.name}: it is no checkpoint of this version, or a part" in caplog.text
    assert ("the run begins again at its start" in caplog.text) == (n == 2)


def test_a_checkpoint_of_an_earlier_version_is_left_out_by_name(folder, whole, resume, caplog):
    for path in checkpoints(folder):
        change(path, lambda data: data.replace(b"checkpoint 3", b"checkpoint 2", 1))
    (folder / JOURNAL).unlink()  # there was none then
    resume(folder)
    expect_same(folder, whole)
    assert caplog.text.count("an earlier version of the program wrote it") == 2
    assert "no note of what was requested of the run is whole" in caplog.text
    assert "the run begins again at its start" in caplog.text


@pytest.mark.parametrize(
    "damage",
    [lambda data: data.replace(b"about = ", b"about = 'x' #"), with_noise(40)],
    ids=["a text", "no text"],
)
def test_a_scene_that_was_changed_is_put_back_and_kept_beside(
    damage, folder, whole, resume, caplog
):
    change(folder / SCENE, damage)
    other = (folder / SCENE).read_bytes()
    resume(folder)
    expect_same(folder, whole)
    assert (folder / CHANGED_SCENE).read_bytes() == other != (folder / SCENE).read_bytes()
    assert f"{SCENE} was changed, damaged or removed; it is as it was again" in caplog.text


def test_a_run_goes_on_from_what_it_wrote_and_from_nothing_else(tmp_path, killed):
    written = {path.name: path.read_bytes() for path in killed.iterdir()}
    plan = resumption_of(killed).plan
    for seed in range(100):
        folder = copied(killed, tmp_path / str(seed))
        damaged_at_random(folder, seed)
        found = resumption_of(folder)
        scene = (folder / SCENE).read_bytes()
        assert found.plan == plan or (found.plan is None and scene == written[SCENE])
        for name, kept in ((FORCES, found.forces), (REPLAY_FRAMES, found.replay)):
            data = (folder / name).read_bytes()[: kept.n_bytes]
            assert len(data) == kept.n_bytes and written[name].startswith(data)
        if found.checkpoint is not None:
            assert found.checkpoint.to_bytes() in [written[name] for name in CHECKPOINT_FILES]
            assert found.n_frames <= len(found.recorded)


@pytest.mark.parametrize(
    "damage",
    [with_rows(lambda rows: [*rows[:50], *rows[51:]]), half, nothing],
    ids=["a row removed", "half", "empty"],
)
def test_a_record_of_a_hand_that_was_damaged_is_refused_by_name(damage, driven_folder, resume):
    change(driven_folder / STROKE, damage)
    before = {path.name: path.read_bytes() for path in driven_folder.iterdir()}
    with pytest.raises(UsageError, match=r"stroke\.csv was changed, damaged or removed"):
        resume(driven_folder)
    assert {path.name: path.read_bytes() for path in driven_folder.iterdir()} == before


def test_what_follows_after_the_record_of_a_hand_is_not_done(driven_folder, led_killed, resume):
    change(driven_folder / STROKE, lambda data: data + data.splitlines(keepends=True)[-1])
    resume(driven_folder)
    assert (driven_folder / STROKE).read_bytes().startswith((led_killed / STROKE).read_bytes())


def test_a_led_run_whose_rows_were_damaged_does_all_that_the_hand_did(
    tmp_path, driven_folder, led_killed, resume
):
    undamaged = copied(led_killed, tmp_path / "undamaged")
    change(driven_folder / FORCES, with_cell(60, "force_x_n", WRONG))
    for folder in (undamaged, driven_folder):
        resume(folder)
    assert np.array_equal(physics(driven_folder), physics(undamaged), equal_nan=True)
    for name in (FINAL, REPLAY, SCENE, STROKE):
        assert (driven_folder / name).read_bytes() == (undamaged / name).read_bytes(), name


def test_a_hand_rests_once_however_often_its_run_goes_on(
    tmp_path, driven_folder, led_killed, resume, monkeypatch
):
    def kill(outputs, summary):
        raise Killed

    once = copied(led_killed, tmp_path / "once")
    resume(once)
    with monkeypatch.context() as killing, pytest.raises(Killed):
        killing.setattr(Outputs, "write_summary", kill)
        resume(driven_folder)
    for path in checkpoints(driven_folder):
        path.unlink()
    resume(driven_folder)
    assert np.array_equal(physics(driven_folder), physics(once), equal_nan=True)
    for name in (FINAL, REPLAY, SCENE, STROKE):
        assert (driven_folder / name).read_bytes() == (once / name).read_bytes(), name


def test_a_recorded_motion_elsewhere_that_was_changed_is_refused_by_name(
    tmp_path, led_killed, resume
):
    stroke = tmp_path / "elsewhere.csv"
    stroke.write_bytes((led_killed / STROKE).read_bytes())
    with pytest.raises(Killed):
        run_in(tmp_path / "run", 60, stroke=str(stroke))
    change(stroke, with_rows(lambda rows: rows[:-1]))
    with pytest.raises(UsageError, match=r"elsewhere\.csv was changed, damaged or removed"):
        resume(tmp_path / "run")
