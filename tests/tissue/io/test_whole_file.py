"""A file appears under its name only when it is whole."""

import contextlib

import pytest

from tests.support.run_files import names_in
from tissue.support import new_whole_file, remove_unfinished, whole_file


def test_until_it_is_whole_the_old_file_is_there(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with whole_file(path) as unfinished:
        unfinished.write_text("new")
        assert path.read_text() == "old"
    assert path.read_text() == "new"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_leaves_the_old_file_and_nothing_beside_it(tmp_path):
    path = tmp_path / "a.txt"
    path.write_text("old")
    with pytest.raises(ZeroDivisionError), whole_file(path) as unfinished:
        unfinished.write_text("half of the new")
        raise ZeroDivisionError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_new_file_replaces_none(tmp_path):
    path = tmp_path / "a.txt"
    for text in ("first", "second"):
        with contextlib.suppress(FileExistsError), new_whole_file(path) as unfinished:
            unfinished.write_text(text)
    assert path.read_text() == "first"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_leaves_no_new_file(tmp_path):
    with pytest.raises(ZeroDivisionError), new_whole_file(tmp_path / "a.txt") as unfinished:
        unfinished.write_text("half of it")
        raise ZeroDivisionError
    assert not list(tmp_path.iterdir())


def test_what_a_killed_process_left_is_removed_and_no_other_file(tmp_path):
    for name in ("a.txt", ".a.txt.123.part", ".b.txt.123.part"):
        (tmp_path / name).write_text("")
    remove_unfinished(tmp_path / "a.txt")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".b.txt.123.part", "a.txt"]
    assert names_in(tmp_path) == ["a.txt"]
