"""A table that grows on disk holds whole rows, also when the disk gets full."""

import resource
from contextlib import contextmanager

import pytest

from scalpel_sim.recording.growing_file import GrowingFile

HEAD = b"a,b\n"
ROWS = b"1,2\n3,4\n"


@contextmanager
def most_bytes_in_a_file(n):
    """Have the system refuse what makes a file longer, as a full disk does: a part is written."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (n, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def test_rows_are_on_disk_at_once(tmp_path):
    file = GrowingFile(tmp_path / "a.csv", HEAD)
    file.append(ROWS)
    assert file.path.read_bytes() == HEAD + ROWS


@pytest.mark.parametrize("room", range(len(HEAD), len(HEAD + ROWS + ROWS)))
def test_a_disk_that_gets_full_takes_whole_rows_and_the_rest_is_kept(tmp_path, room):
    file = GrowingFile(tmp_path / "a.csv", HEAD)
    with most_bytes_in_a_file(room), pytest.raises(OSError, match="large"):
        file.append(ROWS)
        file.append(ROWS)
    assert file.path.read_bytes() == HEAD + (ROWS if room >= len(HEAD + ROWS) else b"")
    n_before = file.sum.n_bytes
    file.append(b"5,6\n")
    kept = ROWS if n_before == len(HEAD + ROWS) else ROWS + ROWS
    assert file.path.read_bytes() == HEAD + kept + b"5,6\n"


def test_a_file_is_cut_back_to_an_earlier_length_whether_it_was_written_or_not(tmp_path):
    file = GrowingFile(tmp_path / "a.csv", HEAD)
    file.append(ROWS)
    mark = file.sum
    with most_bytes_in_a_file(mark.n_bytes), pytest.raises(OSError, match="large"):
        file.append(b"5,6\n")
    file.cut_back(mark)
    file.append(b"7,8\n")
    assert file.path.read_bytes() == HEAD + ROWS + b"7,8\n"
    file.cut_back(None)
    file.append(b"9,9\n")
    assert file.path.read_bytes() == HEAD + b"9,9\n"
