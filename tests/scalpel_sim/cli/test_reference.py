import re
import shlex
from functools import cache
from importlib.metadata import version
from pathlib import Path

import pytest

from scalpel_sim.cli.app import app
from scalpel_sim.cli.options import (
    ArmOptions,
    BladeOptions,
    BodyOptions,
    MaterialOptions,
    SolverOptions,
)
from scalpel_sim.cli.reference import command_line_reference
from scalpel_sim.runs.options import ClientOptions, PrintOptions, RunOutputOptions

pytestmark = pytest.mark.skipif(
    int(version("cyclopts").partition(".")[0]) != 5,
    reason="other versions word the page differently",
)

PAGE = Path(__file__).parents[3] / "docs" / "command_line.md"

GROUPS = {
    "Body": BodyOptions,
    "Material": MaterialOptions,
    "Blade": BladeOptions,
    "Solver": SolverOptions,
    "Arm": ArmOptions,
    "Connection": ClientOptions,
    "Output": (RunOutputOptions, PrintOptions),
}


reference = cache(command_line_reference)


def section(title: str) -> str:
    """Return the section about one command."""
    return re.search(rf"^## {title}\n(.*?)(?=^## |\Z)", reference(), re.S | re.M).group(1)


def test_the_page_of_the_command_line_is_that_of_the_program():
    """To renew it: `python -m scalpel_sim.cli.reference > docs/command_line.md`."""
    assert PAGE.read_text(encoding="utf-8") == command_line_reference()


def test_the_page_does_not_depend_on_the_terminal(monkeypatch):
    at_first = command_line_reference()
    monkeypatch.setenv("COLUMNS", "33")
    monkeypatch.setenv("TERM", "dumb")
    monkeypatch.setattr("sys.argv", ["/somewhere/else/python", "-x"])
    assert command_line_reference() == at_first
    assert not re.search(r"/(home|root|tmp|usr)/", at_first)


@pytest.mark.parametrize("name", GROUPS)
def test_run_has_its_options_in_groups(name):
    options = re.findall(r"\*\*(\w+)\*\*:\n(.*?)(?=\n\*\*|\Z)", section("scalpel-sim run"), re.S)
    listed = set(re.findall(r"^\* `--([a-z-]+)", dict(options)[name], re.M))
    classes = GROUPS[name] if isinstance(GROUPS[name], tuple) else (GROUPS[name],)
    fields = {field for each in classes for field in each.__dataclass_fields__}
    assert listed == {field.replace("_", "-") for field in fields}


@pytest.mark.parametrize("command", ["view", "serve"])
def test_commands_share_the_groups_that_are_about_the_tissue(command):
    def part(name: str, of: str) -> str:
        return re.search(rf"\*\*{name}\*\*:\n(.*?)(?=\n\*\*|\Z)", section(of), re.S).group(1)

    for name in ("Body", "Material", "Blade", "Solver"):
        assert part(name, f"scalpel-sim {command}") == part(name, "scalpel-sim run")


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


def test_there_is_no_seed_because_nothing_is_random():
    assert "--seed" not in reference()
