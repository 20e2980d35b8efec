"""A process that records is killed at a random instant; the file is whole as it is left."""

import mmap
import os
import signal
import struct
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim import SavedRun
from scalpel_sim.saved_run.growing_tables import GrowingTables
from scalpel_sim.saved_run.preallocated_file import STEP_TIMES, GrowingTable
from tests.long.forked_runs import ForkedRuns, count_in
from tests.support.battery import battery
from tests.support.vtk_steps import VtkSteps

SECONDS = 0.6
"""Length of a run, in which the blade cuts from the first tenth [s]."""

MOST_LOST = 100
"""Frames of a millisecond that a kill may cost."""


@pytest.fixture(scope="module")
def forked_runs():
    with ForkedRuns() as runs:
        yield runs


def words(folder):
    record = str(folder / "run.vtkhdf")
    return ("run", "grid2", "-q", "--seconds", str(SECONDS), "--out", folder, "--record", record)


@pytest.fixture(scope="module")
def whole(forked_runs, tmp_path_factory):
    """All steps of a run that was not killed, by time."""
    folder = tmp_path_factory.mktemp("whole")
    program = forked_runs.start(folder / "count", *map(str, words(folder)))
    program.communicate(timeout=120)
    assert program.returncode == 0
    with SavedRun(folder / "run.vtkhdf") as run:
        assert run.step(-1).surface.is_cut.any()
        return {step.time: step for step in map(run.step, range(len(run)))}


def assert_same(step, expected):
    assert step.wrench.numbers == expected.wrench.numbers
    for one, other in (
        *zip(step.snapshot, expected.snapshot, strict=True),
        *zip(step.deformation, expected.deformation, strict=True),
        *zip(step.surface[:4], expected.surface[:4], strict=True),
        (step.cut_age, expected.cut_age),
        (step.body_poses, expected.body_poses),
    ):
        assert np.array_equal(one, other, equal_nan=True)


@battery(n_per_change=6, n_long=100)
def test_a_recording_of_a_run_that_is_killed_opens_and_lacks_at_most_100_ms(
    case, forked_runs, whole
):
    random = np.random.default_rng(case)
    # The process that draws outlives a run that is killed for as long as it draws.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder, count = Path(name), Path(name) / "count"
        program = forked_runs.start(count, *map(str, words(folder)))
        frame = random.integers(0, round(SECONDS * 1e3) + 1)
        while program.poll() is None and count_in(count) < frame:
            time.sleep(1e-4)
        time.sleep(random.exponential(5e-3))
        program.send_signal(signal.SIGKILL)
        program.communicate(timeout=120)
        n_frames, path = count_in(count), folder / "run.vtkhdf"
        if not path.exists():
            assert n_frames == 0
            return
        steps = VtkSteps(path)
        with SavedRun(path) as run:
            assert len(steps) == len(run) and np.array_equal(steps.times, run.times)
            assert n_frames - round(run.times[-1] * 1e3) <= MOST_LOST
            assert n_frames - len(run.rows) <= MOST_LOST
            for i, moment in enumerate(run.times):
                step, seen = run.step(i), steps.step(i)
                assert_same(step, whole[moment])
                assert np.array_equal(seen.points, step.snapshot.positions)
                assert np.array_equal(seen.tetrahedra, step.snapshot.tetrahedra)
                assert np.array_equal(
                    seen.cell_data["stress"], step.deformation.stress.reshape(-1, 9)
                )


TABLES = (
    GrowingTable(STEP_TIMES, "f8"),
    GrowingTable("own/squares", "i8", (2, 2)),
    GrowingTable("own/lists", "f4"),
)
"""Tables with room for one row: it is doubled again and again."""


def write_steps(path, count):
    """Write steps until killed, and count those that are shown."""
    file = GrowingTables(path, TABLES, lambda _: None)
    for i in range(1 << 20):
        file.append("own/squares", [[i, i * i], [-i, 7]])
        file.append("own/lists", np.full(i % 5, i))
        file.append(STEP_TIMES, 0.04 * i)
        file.commit()
        struct.pack_into("<q", count, 0, i + 1)
        if i % 100 == 50:  # the last ten, once more
            file.cut_back((i - 9, i - 9, sum(k % 5 for k in range(i - 9))))
            for k in range(i - 9, i + 1):
                file.append("own/squares", [[k, k * k], [-k, 7]])
                file.append("own/lists", np.full(k % 5, k))
                file.append(STEP_TIMES, 0.04 * k)
                file.commit()


@battery(n_per_change=20, n_long=1_000)
def test_tables_whose_writer_is_killed_have_every_step_that_was_shown(case):
    import h5py

    random = np.random.default_rng(case)
    with tempfile.TemporaryDirectory() as name:
        path, count = Path(name) / "tables.vtkhdf", mmap.mmap(-1, 8)
        child = os.fork()
        if child == 0:
            try:
                write_steps(path, count)
            finally:
                os._exit(1)
        while not path.exists():
            time.sleep(1e-3)
        time.sleep(random.uniform(0.0, 0.2))
        os.kill(child, signal.SIGKILL)
        assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == -signal.SIGKILL
        (n_shown,) = struct.unpack("<q", count[:8])
        with h5py.File(path) as file:
            n = int(file["VTKHDF/Steps"].attrs["NSteps"])
            assert len(file[STEP_TIMES]) == n >= n_shown - 10
            assert np.array_equal(file[STEP_TIMES][:], 0.04 * np.arange(n))
            i = np.arange(n)
            squares = np.stack([i, i * i, -i, np.full(n, 7)], axis=1).reshape(n, 2, 2)
            assert np.array_equal(file["own/squares"][:n], squares)
            lists = np.repeat(i, i % 5)
            assert np.array_equal(file["own/lists"][: len(lists)], lists.astype("f4"))
