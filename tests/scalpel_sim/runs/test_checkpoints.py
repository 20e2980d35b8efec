"""The last two checkpoints of a run are kept, each whole, and none of what was undone."""

import resource

import pytest

from scalpel_sim.recording.growing_file import FileSum
from scalpel_sim.runs.checkpoints import Checkpoint, Checkpoints, RunMark, RunPlan, read_checkpoint
from scalpel_sim.runs.file_names import CHECKPOINT_FILES
from tissue import StateError


def checkpoint(n_frames, n_bytes=1000):
    """Return a checkpoint whose state is so long."""
    plan = RunPlan(1e-3, "name = 'slab'", ["/a.stl"], {"young": 1e4}, 1.5)
    mark = RunMark(n_frames, {"forces.csv": FileSum(10 * n_frames, 7)})
    return Checkpoint(plan, mark, bytes([n_frames % 256]) * n_bytes)


def written(folder, *n_frames, every=100):
    """Return the checkpoints of a folder into which these were written."""
    checkpoints = Checkpoints(folder, every)
    for n in n_frames:
        checkpoints.write(lambda n=n: checkpoint(n))
    checkpoints.finish()
    return checkpoints


def frames_in(folder):
    """Return the frames of the checkpoints in a folder, the last one first."""
    with Checkpoints(folder) as checkpoints:
        return [each.mark.n_frames for each in checkpoints.read()]


def test_a_checkpoint_is_read_as_it_was_written():
    assert Checkpoint.from_bytes(checkpoint(300).to_bytes()) == checkpoint(300)


@pytest.mark.parametrize("at", [0, 30, 60, 90, 200, -1])
def test_no_bit_of_a_checkpoint_can_be_lost_unseen(at, tmp_path):
    data = bytearray(checkpoint(300).to_bytes())
    data[at] ^= 1
    path = tmp_path / CHECKPOINT_FILES[0]
    path.write_bytes(data)
    with pytest.raises(StateError, match="no checkpoint of this version, or a part is missing"):
        read_checkpoint(path)


def test_the_last_two_are_kept(tmp_path):
    with written(tmp_path, 0, 100, 200, 300):
        assert frames_in(tmp_path) == [300, 200]
        assert sorted(path.name for path in tmp_path.iterdir()) == sorted(CHECKPOINT_FILES)


def test_one_is_due_after_so_many_frames(tmp_path):
    with written(tmp_path, 250) as checkpoints:
        assert [checkpoints.is_due(n) for n in (349, 350, 351)] == [False, True, True]
    with Checkpoints(tmp_path, 0) as checkpoints:
        assert not checkpoints.is_due(10_000)


def test_those_of_what_was_undone_are_removed_and_one_is_due(tmp_path):
    with written(tmp_path, 100, 200) as checkpoints:
        checkpoints.cut_back(150)
        assert frames_in(tmp_path) == [100]
        assert checkpoints.is_due(150)


def test_a_run_that_goes_on_replaces_the_older_one(tmp_path):
    written(tmp_path, 100, 200).close()
    with Checkpoints(tmp_path, 100) as checkpoints:
        checkpoints.read()
        checkpoints.cut_back(200)
        assert not checkpoints.is_due(299)
        checkpoints.write(lambda: checkpoint(300))
    assert frames_in(tmp_path) == [300, 200]


def test_where_the_disk_is_full_the_last_whole_one_stays_and_that_is_said_once(tmp_path, caplog):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    with written(tmp_path, 100, 200) as checkpoints:
        resource.setrlimit(resource.RLIMIT_FSIZE, (10_000, before[1]))
        try:
            for n in (300, 400):
                checkpoints.write(lambda n=n: checkpoint(n, 100_000))
                checkpoints.finish()
        finally:
            resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert frames_in(tmp_path)[0] == 200
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(CHECKPOINT_FILES)
    assert caplog.text.count("a checkpoint cannot be written") == 1
