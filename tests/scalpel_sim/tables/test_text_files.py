"""A file that another one names is refused before it takes memory, or lets the program wait."""

import os
from functools import partial
from pathlib import Path

import pytest

from scalpel_sim.errors import UsageError
from scalpel_sim.strokes.grasp_motion import grasp_from_csv
from scalpel_sim.strokes.stroke import from_csv
from scalpel_sim.tables.text_files import read_text_file, read_toml
from scalpel_sim.validate.cases.expected import read_curve

READERS = {
    "toml": partial(read_toml, how_to_begin="write one"),
    "stroke": from_csv,
    "grasper": partial(grasp_from_csv, name="left"),
    "curve": read_curve,
}


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_what_is_no_file_is_refused_by_name(read, tmp_path):
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    for path in (Path("/dev/null"), tmp_path, pipe):
        with pytest.raises(UsageError, match=rf"{path}\b.*a folder, a device or a pipe"):
            read(path)


@pytest.mark.parametrize("read", READERS.values(), ids=READERS)
def test_a_file_that_is_too_large_is_refused_by_name(read, tmp_path):
    path = tmp_path / "large.csv"
    with path.open("wb") as file:
        file.truncate(1 << 40)
    with pytest.raises(UsageError, match=r"large.csv\b.* 1099511627776 bytes; .*at most \d"):
        read(path)


def test_a_file_of_the_largest_size_is_read(tmp_path):
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbfone\r\ntwo")
    assert read_text_file(path, path.stat().st_size) == "one\ntwo"
    with pytest.raises(UsageError, match="it has 11 bytes; give one of at most 10"):
        read_text_file(path, path.stat().st_size - 1)
