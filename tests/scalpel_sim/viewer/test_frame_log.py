"""The frames of a replay are in a file, with which another process can go on."""

import numpy as np
import pytest

from scalpel_sim.viewer import replay as replay_module
from scalpel_sim.viewer.frame_log import FrameLog
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.replay import BYTES_PER_TRIANGLE, ReplayWriter
from tests.scalpel_sim.little_arm import little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue


def state(i):
    """Return what a frame shows: of three that follow each other, or of another such three."""
    surface = cut_tissue()[i % 3]
    values = {"displacement": np.full(len(surface.positions), 1e-3 * i)}
    return SceneState(surface, body_poses(little_arm()[1]), readings(0.1 * i), values=values)


def same(one, other):
    """Return whether two values hold the same arrays and numbers."""
    if isinstance(one, np.ndarray):
        return one.dtype == other.dtype and np.array_equal(one, other)
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(same(one[key], other[key]) for key in one)
    if isinstance(one, (tuple, list)):
        return len(one) == len(other) and all(map(same, one, other))
    return one == other


def test_a_frame_is_read_as_it_was_added(tmp_path):
    log = FrameLog(tmp_path / "frames")
    kept = [log.add(0.1 * i, state(i)) for i in range(3)]
    assert log.frames() == kept
    for i, frame in enumerate(kept):
        assert frame.time == 0.1 * i
        assert same(log.read(frame), state(i))


def test_a_log_goes_on_after_a_mark(tmp_path):
    path = tmp_path / "frames"
    log = FrameLog(path)
    log.add(0.0, state(0))
    mark = log.sum
    log.add(0.1, state(1))
    log.close()
    again = FrameLog(path, mark)
    again.add(0.2, state(2))
    assert [frame.time for frame in again.frames()] == [0.0, 0.2]


def test_a_log_that_is_shorter_than_its_mark_is_refused(tmp_path):
    path = tmp_path / "frames"
    log = FrameLog(path)
    log.add(0.0, state(0))
    log.close()
    with pytest.raises(OSError, match="a part of it is missing"):
        FrameLog(path, log.sum.after(b"0"))


@pytest.mark.parametrize("at", [1, 30, 70])
def test_a_replay_that_is_gone_on_with_is_that_of_a_whole_run(at, tmp_path, monkeypatch):
    limit = 20 * len(cut_tissue()[0].triangles) * BYTES_PER_TRIANGLE  # so that frames are dropped
    monkeypatch.setattr(replay_module, "FILE_LIMIT", limit)
    model, data = little_arm()

    def play(replay, first, end):
        for i in range(first, end):
            if replay.is_due(0.04 * i):
                replay.add(
                    0.04 * i, SceneState(cut_tissue()[0], body_poses(data), readings(0.04 * i))
                )

    log = FrameLog(tmp_path / "b")
    whole, killed = ReplayWriter(model, log=FrameLog(tmp_path / "a")), ReplayWriter(model, log=log)
    play(whole, 0, 100)
    play(killed, 0, at)
    mark = killed.mark()
    play(killed, at, at + 20)
    log.close()
    again = ReplayWriter(model, log=FrameLog(tmp_path / "b", mark))
    play(again, at, 100)
    for name, replay in (("whole", whole), ("again", again)):
        replay.write(tmp_path / f"{name}.html")
    pages = [(tmp_path / f"{name}.html").read_bytes() for name in ("whole", "again")]
    assert pages[0] == pages[1]
