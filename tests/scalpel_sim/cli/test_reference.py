import re
import shlex
from functools import cache
from importlib.metadata import version
from pathlib import Path

import pytest

from scalpel_sim.cli.app import app
from scalpel_sim.cli.reference import command_line_reference

pytestmark = pytest.mark.skipif(
    int(version("cyclopts").partition(".")[0]) != 5,
    reason="other versions word the page differently",
)

PAGE = Path(__file__).parents[3] / "docs" / "command_line.md"


reference = cache(command_line_reference)


def test_the_page_of_the_command_line_is_that_of_the_program():
    """To renew it: `python -m scalpel_sim.cli.reference > docs/command_line.md`."""
    assert PAGE.read_text(encoding="utf-8") == reference()


def test_the_page_does_not_depend_on_the_terminal(monkeypatch):
    at_first = reference()
    monkeypatch.setenv("COLUMNS", "33")
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr("sys.argv", ["/somewhere/else/python", "-x"])
    assert command_line_reference() == at_first
    assert not re.search(r"/(home|root|tmp|usr)/", at_first)


def examples() -> list[str]:
    """Return the commands that the page shows, without the usage of each."""
    page = PAGE.read_text(encoding="utf-8")
    found = re.findall(r"^(?:\w+=\S+ )?scalpel-sim ([a-z].*)$", page, re.MULTILINE)
    return [line for line in found if "[OPTIONS]" not in line]


@pytest.mark.parametrize("command", ["run", "view", "serve", "new", "materials"])
def test_a_command_has_an_example(command):
    assert any(example.split()[0] == command for example in examples())


@pytest.mark.parametrize("example", examples())
def test_an_example_is_a_command(example):
    """It has all that it needs, and no option that there is not."""
    words = shlex.split(example)
    command, *_ = app.parse_args(words, exit_on_error=False, print_error=False)
    _, parts, _ = app.parse_commands(words)
    assert command is parts[-1].default_command
