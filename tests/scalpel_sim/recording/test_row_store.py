"""Rows without end: what memory does not hold is in a file, and reads as if it were."""

import resource

import numpy as np
import pytest

from scalpel_sim.errors import RunError
from scalpel_sim.recording.recording import ROWS_IN_MEMORY, ROWS_PER_WRITE, Recording, RowStore

N_COLUMNS = 3
N_ROWS = ROWS_IN_MEMORY + 5 * ROWS_PER_WRITE + 7


def numbers(n, first=0):
    """Return rows that all differ."""
    return np.arange(N_COLUMNS * first, N_COLUMNS * (first + n), dtype=float).reshape(n, N_COLUMNS)


def filled(n, folder=None):
    store = RowStore(N_COLUMNS, folder)
    for row in numbers(n).tolist():
        store.append(row)
    return store


@pytest.mark.parametrize("n", [0, 1, ROWS_IN_MEMORY, ROWS_IN_MEMORY + 1, N_ROWS])
def test_all_rows_are_read_as_they_were_added(n, tmp_path):
    store = filled(n, tmp_path)
    assert len(store) == n
    assert store.are_in_memory == (n <= ROWS_IN_MEMORY)
    assert np.array_equal(store.rows(), numbers(n))
    assert np.array_equal(np.concatenate([part.copy() for part in store.parts()]), numbers(n))


def test_rows_can_be_added_after_all_were_read(tmp_path):
    store = filled(N_ROWS, tmp_path)
    assert np.array_equal(store.rows(), numbers(N_ROWS))
    for row in numbers(1000, N_ROWS).tolist():
        store.append(row)
    assert np.array_equal(store.rows(), numbers(N_ROWS + 1000))


@pytest.mark.parametrize("kept", [0, 10, ROWS_IN_MEMORY, N_ROWS - 3, N_ROWS])
def test_rows_that_were_cut_off_are_replaced_by_those_that_follow(kept, tmp_path):
    store = filled(N_ROWS, tmp_path)
    store.cut_back(kept)
    assert np.array_equal(store.rows(), numbers(kept))
    for row in (-numbers(300)).tolist():
        store.append(row)
    assert np.array_equal(store.rows(), np.concatenate([numbers(kept), -numbers(300)]))


@pytest.mark.parametrize("n", [0, 10, ROWS_IN_MEMORY, N_ROWS - 3, N_ROWS])
def test_the_rows_after_some_are_the_last_ones(n, tmp_path):
    assert np.array_equal(filled(N_ROWS, tmp_path).since(n), numbers(N_ROWS)[n:])


def test_nothing_is_left_of_the_file_in_its_folder(tmp_path):
    store = filled(N_ROWS, tmp_path)
    assert not store.are_in_memory
    assert list(tmp_path.iterdir()) == []


def test_a_recording_reads_its_columns_from_the_file():
    recording = Recording()
    rows = np.random.default_rng(0).normal(size=(N_ROWS, len(recording.columns)))
    for row in rows.tolist():
        recording.append(row)
    force = rows[:, recording.columns.index("force_x_n") :][:, :3]
    assert np.array_equal(recording.rows, rows)
    assert np.array_equal(recording.vector("force"), force)
    assert np.array_equal(recording.sizes("force"), np.linalg.norm(force, axis=1))
    area = rows[:, recording.columns.index("cut_area_m2")]
    assert np.array_equal(recording.column("cut_area_m2"), area)
    assert recording.at_end("cut_area_m2") == area[-1]


def test_a_full_disk_is_an_error_that_names_the_folder_and_loses_no_row(tmp_path):
    store = filled(N_ROWS, tmp_path)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (8 * N_COLUMNS * (N_ROWS + 10), before[1]))
    try:
        with pytest.raises(RunError, match=rf"{tmp_path}: the recording cannot be written there"):
            for row in numbers(2000, N_ROWS).tolist():
                store.append(row)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert len(store) > N_ROWS
    assert np.array_equal(store.rows(), numbers(len(store)))
