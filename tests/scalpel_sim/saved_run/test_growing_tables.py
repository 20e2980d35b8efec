"""Tables of a file that grows are read by HDF5 as they were shown last, at any time."""

import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from scalpel_sim.errors import RunError
from scalpel_sim.saved_run.growing_tables import GrowingTables
from scalpel_sim.saved_run.preallocated_file import STEP_TIMES, GrowingTable

ROOT = Path(__file__).parents[3]

PATIENCE = 30.0
"""How long a thread may take to copy some kilobytes [s]: the machine may be busy."""

TABLES = (
    GrowingTable(STEP_TIMES, "f8", capacity=2),
    GrowingTable("own/pairs", "f4", (2,)),
    GrowingTable("own/empty", "i8"),
)


def add_step(tables, i):
    first = tables.append("own/pairs", [[i, k] for k in range(i)])
    tables.append(STEP_TIMES, 0.5 * i)
    return first


def pairs_until(n):
    return np.array([[i, k] for i in range(n) for k in range(i)], "f4").reshape(-1, 2)


def read(path):
    with h5py.File(path) as file:
        n = int(file["VTKHDF/Steps"].attrs["NSteps"])
        assert np.array_equal(file[STEP_TIMES][:], 0.5 * np.arange(n))
        return n, file["own/pairs"][:]


@pytest.fixture
def tables(tmp_path):
    tables = GrowingTables(tmp_path / "run.vtkhdf", TABLES, lambda file: file.create_group("more"))
    yield tables
    tables.close()
    assert [each.name for each in tmp_path.iterdir()] in ([], ["run.vtkhdf"])


def test_after_each_step_all_of_it_is_seen_and_rooms_grow(tables):
    for i in range(40):
        assert add_step(tables, i) == i * (i - 1) // 2
        tables.commit()
        n, pairs = read(tables.path)
        assert n == i + 1
        expected = pairs_until(n)
        assert np.array_equal(pairs[: len(expected)], expected)
        assert len(pairs) == max(len(expected), 1)  # HDF5 takes no empty table that has a place


def test_the_file_is_not_there_before_its_first_step(tables):
    add_step(tables, 0)
    assert not tables.path.exists()
    tables.commit()
    assert read(tables.path)[0] == 1


def test_rows_of_a_step_that_is_not_shown_are_not_seen(tables):
    for i in range(3):
        add_step(tables, i)
    tables.commit()
    for i in range(3, 9):  # so many that there is no room
        add_step(tables, i)
        n, pairs = read(tables.path)
        assert n == 3 and np.array_equal(pairs, pairs_until(3))


def test_steps_that_are_taken_off_are_written_again(tables):
    lengths = []
    for i in range(9):
        add_step(tables, i)
        tables.commit()
        lengths.append(tables.lengths)
    tables.cut_back(lengths[3])
    n, pairs = read(tables.path)
    assert n == 4 and np.array_equal(pairs, pairs_until(4))
    for i in range(4, 30):
        add_step(tables, i)
        tables.commit()
    n, pairs = read(tables.path)
    assert n == 30 and np.array_equal(pairs, pairs_until(30))


def test_more_room_is_made_before_there_is_none_and_steps_go_on_meanwhile(tmp_path):
    large = tuple(each._replace(capacity=400) for each in TABLES)
    tables = GrowingTables(tmp_path / "run.vtkhdf", large, lambda _: None)
    lengths = []
    for i in range(24):  # 276 pairs: more than six tenths
        add_step(tables, i)
        tables.commit()
        lengths.append(tables.lengths)
        if i == 0:
            before = tables.path.stat().st_size
    tables.cut_back(lengths[19])
    for i in range(20, 28):
        add_step(tables, i)
        tables.commit()
    end = time.monotonic() + PATIENCE
    while tables.path.stat().st_size == before and time.monotonic() < end:
        time.sleep(0.01)
        tables.commit()
    assert tables.lengths[1] < 400 and tables.path.stat().st_size == before + 400 * 8
    n, pairs = read(tables.path)
    assert n == 28 and np.array_equal(pairs, pairs_until(28))
    tables.finish()
    assert read(tables.path)[0] == 28 and [each.name for each in tmp_path.iterdir()] == [
        "run.vtkhdf"
    ]


def test_a_recording_that_ends_while_room_is_made_leaves_one_file(tmp_path):
    large = tuple(each._replace(capacity=400) for each in TABLES)
    tables = GrowingTables(tmp_path / "run.vtkhdf", large, lambda _: None)
    for i in range(24):
        add_step(tables, i)
        tables.commit()
    tables.finish()
    n, pairs = read(tables.path)
    assert n == 24 and np.array_equal(pairs, pairs_until(24))
    assert [each.name for each in tmp_path.iterdir()] == ["run.vtkhdf"]


def test_in_the_end_there_is_no_room_left_and_empty_tables_are_empty(tables):
    for i in range(5):
        add_step(tables, i)
        tables.commit()
    before = tables.path.stat().st_size
    tables.finish()
    n, pairs = read(tables.path)
    assert n == 5 and np.array_equal(pairs, pairs_until(5))
    assert tables.path.stat().st_size <= before
    with h5py.File(tables.path) as file:
        assert file["own/empty"].shape == (0,) and "more" in file


def test_a_file_continues_with_the_rows_that_are_kept(tables):
    lengths = []
    for i in range(9):
        add_step(tables, i)
        tables.commit()
        lengths.append(tables.lengths)
    tables.finish()
    with h5py.File(tables.path) as file:
        starts = {each.name: file[each.name].id.get_offset() or 0 for each in TABLES}
    again = GrowingTables(tables.path, TABLES, lambda _: None)
    assert read(tables.path)[0] == 9
    again.take(starts, lengths[5])
    n, pairs = read(tables.path)
    assert n == 6 and np.array_equal(pairs, pairs_until(6))
    for i in range(6, 12):
        add_step(again, i)
        again.commit()
    again.finish()
    n, pairs = read(tables.path)
    assert n == 12 and np.array_equal(pairs, pairs_until(12))


def test_a_folder_that_is_not_there_is_named(tmp_path):
    with pytest.raises(RunError, match=r"nowhere/run\.vtkhdf: cannot be written"):
        GrowingTables(tmp_path / "nowhere" / "run.vtkhdf", TABLES, lambda _: None)


def test_two_runs_never_write_one_file(tables, tmp_path):
    """The second is refused, and what the first writes is all there."""
    for i in range(9):
        add_step(tables, i)
        tables.commit()
        with pytest.raises(RunError, match=r"run\.vtkhdf: another run is writing .* --record"):
            GrowingTables(tables.path, TABLES, lambda _: None)
    tables.finish()
    n, pairs = read(tables.path)
    assert n == 9 and np.array_equal(pairs, pairs_until(9))
    second = GrowingTables(tables.path, TABLES, lambda _: None)
    add_step(second, 0)
    second.commit()
    second.finish()
    assert read(tables.path)[0] == 1


def test_a_run_that_was_killed_stops_no_other(tmp_path):
    path = tmp_path / "run.vtkhdf"
    code = (
        "import os; from pathlib import Path\n"
        "from tests.scalpel_sim.saved_run.test_growing_tables import GrowingTables, TABLES\n"
        f"tables = GrowingTables(Path({str(path)!r}), TABLES, lambda _: None)\n"
        "os.kill(os.getpid(), 9)"
    )
    killed = subprocess.run([sys.executable, "-c", code], cwd=ROOT)
    assert killed.returncode != 0 and list(tmp_path.glob(".run.vtkhdf.*"))
    tables = GrowingTables(path, TABLES, lambda _: None)
    add_step(tables, 0)
    tables.commit()
    tables.finish()
    assert [each.name for each in tmp_path.iterdir()] == ["run.vtkhdf"]
