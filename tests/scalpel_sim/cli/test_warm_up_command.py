"""`scalpel-sim warm-up` says what it compiled and where; the progress of it moves."""

import io
import json

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK
from scalpel_sim.runs import console
from scalpel_sim.runs.options import PrintOptions
from tissue.support import cache_directory, n_compiled_kernels


def test_it_prints_the_folder_that_holds_the_kernels(capsys):
    assert command_line(["warm-up", "grid2", "--json"]) == EXIT_OK
    printed = json.loads(capsys.readouterr().out)
    assert printed["folder"] == str(cache_directory())
    assert printed["folder"].startswith(printed["root"])
    assert printed["kernels"] == n_compiled_kernels() > 100
    assert printed["bytes"] > 1e6


@pytest.fixture
def clock(monkeypatch):
    """The time of day, which a test sets."""
    now = [0.0]
    monkeypatch.setattr(console.time, "monotonic", lambda: now[0])
    return now


def test_progress_is_a_few_lines_where_there_is_no_terminal(clock, capsys):
    with console.compiling(PrintOptions()) as show:
        for n in range(100):
            clock[0] = 0.1 * n
            show(n, 100)
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[1] for line in lines] == ["0 of 100, 0 s", "50 of 100, 5 s"]


def test_progress_is_rewritten_in_place_on_a_terminal(monkeypatch):
    class Terminal(io.StringIO):
        def isatty(self):
            return True

    monkeypatch.setattr("sys.stderr", terminal := Terminal())
    with console.compiling(PrintOptions()) as show:
        show(3, 100)
        show(57, 100)
    drawn = terminal.getvalue()
    assert "3/100" in drawn and "57/100" in drawn
    assert drawn.endswith("\x1b[2K")  # erased


def test_nothing_is_shown_to_those_who_want_quiet(capsys):
    with console.compiling(PrintOptions(quiet=True)) as show:
        show(3, 100)
    assert not capsys.readouterr().err
