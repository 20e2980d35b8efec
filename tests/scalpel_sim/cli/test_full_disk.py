"""On a full disk the commands that write a single file name it, and leave it as it was."""

import re

import pytest

from tests.support.small_disk import run_on_a_full_disk

WORDS = {
    "key": ("key", "/mnt/new.key"),
    "scene": ("new", "/mnt/new.toml"),
    "material": ("materials", "--write", "/mnt/new.toml"),
}

pytestmark = pytest.mark.usefixtures("small_disks")


@pytest.mark.parametrize("words", WORDS.values(), ids=WORDS)
def test_a_full_disk_is_said_in_one_line_and_leaves_no_file(words, tmp_path):
    done = run_on_a_full_disk(*words, folder=tmp_path)
    assert done.returncode == 1
    assert re.search(r"error: .*/mnt/new\.\w+:? cannot be written.*No space.*choose", done.stderr)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("name", ["scene", "material"])
def test_a_file_that_is_replaced_by_force_stays_on_a_full_disk(name, tmp_path):
    (tmp_path / "new.toml").write_text("what was there")
    done = run_on_a_full_disk(*WORDS[name], "--force", folder=tmp_path)
    assert done.returncode == 1 and "No space" in done.stderr
    assert (tmp_path / "new.toml").read_text() == "what was there"
    assert len(list(tmp_path.iterdir())) == 1
