"""`scalpel-sim warm-up` says what it compiled and where; the progress of it moves."""

import io
import json
import os
import platform
import shutil
import subprocess

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE
from scalpel_sim.runs import console
from scalpel_sim.runs.options import PrintOptions
from tests.support.battery import battery
from tests.support.processes import PROGRAM, environment
from tissue.support import LEVELS, cache_directory, n_compiled_kernels


def test_it_prints_the_folder_that_holds_the_kernels(capsys):
    assert command_line(["warm-up", "grid2", "--json"]) == EXIT_OK
    printed = json.loads(capsys.readouterr().out)
    assert printed["folder"] == str(cache_directory())
    assert printed["folder"].startswith(printed["root"])
    assert printed["kernels"] == n_compiled_kernels() > 100
    assert printed["bytes"] > 1e6


def test_a_level_that_this_machine_does_not_reach_is_refused(capsys):
    """Kernels are compiled as they run, so not for an architecture that runs none of them here."""
    other = "x86-64-v3" if platform.machine() in ("aarch64", "arm64") else "neoverse"
    assert command_line(["warm-up", "--target", other]) == EXIT_WRONG_USE
    assert f"cannot compile for {other} here" in capsys.readouterr().err


def test_a_file_for_a_bundle_needs_its_level(capsys):
    assert command_line(["warm-up", "--out", "kernels.zip"]) == EXIT_WRONG_USE
    assert "--target" in capsys.readouterr().err


HERE = [name for name, level in LEVELS.items() if not level.missing()]
"""Levels that this machine reaches."""

OF_A_LEVEL = pytest.mark.skipif(not HERE, reason="this machine reaches no level")


def serve_a_run(level, cache, tmp_path):
    """Make the bundle of a level with a cache, and expect a run in a fresh home to need no more."""
    file = tmp_path / "kernels.zip"
    command = [*PROGRAM, "warm-up", "grid2", "--target", level, "--out", file, "--json"]
    places = {"NUMBA_CACHE_DIR": str(cache)}
    made = subprocess.run(
        command, env=environment() | places, capture_output=True, text=True, check=True
    )
    assert json.loads(made.stdout)["programs"] > 50
    fresh = {"HOME": str(tmp_path / "home"), "SCALPEL_SIM_BUNDLE": str(file)}
    variables = {name: value for name, value in os.environ.items() if name != "NUMBA_CACHE_DIR"}
    ran = subprocess.run(
        [*PROGRAM, "run", "grid2", "--seconds", "0.1", "--out", tmp_path / "out"],
        env=variables | {"PYTHONPATH": environment()["PYTHONPATH"]} | fresh,
        capture_output=True,
        text=True,
        check=True,
    )
    assert not ran.stderr
    assert not list((tmp_path / "home").rglob("*.nbc"))


@pytest.mark.end_to_end
@OF_A_LEVEL
def test_a_bundle_of_a_level_serves_a_run_in_a_fresh_home(tmp_path):
    """Of kernels for this processor in the place of those of the level, which take a minute."""
    assert command_line(["warm-up", "grid2", "-q"]) == EXIT_OK
    cache = tmp_path / "cache"
    shutil.copytree(cache_directory(), cache / "kernels" / LEVELS[HERE[0]].folder.name)
    serve_a_run(HERE[0], cache, tmp_path)


@OF_A_LEVEL
@battery(n_per_change=0, n_long=len(HERE))
def test_kernels_of_each_level_serve_a_run_in_a_fresh_home(case, tmp_path):
    here = tmp_path / HERE[case]
    here.mkdir()
    serve_a_run(HERE[case], here / "cache", here)


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
