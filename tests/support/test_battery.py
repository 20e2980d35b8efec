"""The frame of the batteries, on small batteries whose failing cases are known."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

BATTERY = """
import pytest
from tests.support.battery import Disagreement, battery

@battery(n_per_change=10, n_long=1000)
def test_squares_end_in_other_digits_than_7(case):
    assert case % 100 != 7

@pytest.mark.parametrize("step", [1, 2])
@battery(n_per_change=5, n_long=50)
def test_steps(tmp_path, case, step):
    assert tmp_path.is_dir()
    assert case * step != 6

@battery(n_per_change=100, n_long=1000, disagreements=0.01)
def test_few_disagree(tally, case):
    tally["odd"] += case % 2
    if case % 100 == 50 or case == 999:
        raise Disagreement("why")
"""


@pytest.fixture
def run(tmp_path):
    """Return a function that runs pytest on these batteries and returns what it printed."""
    (tmp_path / "test_small.py").write_text(BATTERY)
    (tmp_path / "pytest.ini").write_text("[pytest]\nmarkers =\n    long: a battery\n")

    def run_with(*options, status=False):
        command = [sys.executable, "-m", "pytest", "-p", "tests.support.battery", *options]
        done = subprocess.run(
            command, cwd=tmp_path, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True
        )
        return done.returncode if status else done.stdout + done.stderr

    return run_with


def counts(printed, name):
    """Return the printed number of cases of a battery, and of failures."""
    found = re.search(rf"{name}: (\d+) cases, (\d+) failed", printed)
    return tuple(map(int, found.groups()))


SQUARES, STEPS = "test_squares_end_in_other_digits_than_7", "test_steps"


def commands(printed):
    return [line for line in printed.splitlines() if line.startswith("pytest ")]


def test_a_change_runs_the_few_cases_and_a_long_run_the_many(run):
    printed = run()
    assert counts(printed, SQUARES) == (10, 1)
    assert counts(printed, STEPS) == (10, 1)
    printed = run("--long", "-k", "squares or steps")
    assert counts(printed, SQUARES) == (1000, 10)
    assert counts(printed, STEPS) == (100, 2)


def test_the_printed_command_of_each_failure_runs_that_case_alone(run):
    printed = [*commands(run()), *commands(run("--long", "-k", "steps"))]
    assert len(printed) == 4
    for command in printed:
        again = run(*shlex.split(command)[1:])
        assert re.search(r": 1 cases, 1 failed", again)
        assert commands(again) == [command]


def test_a_battery_goes_on_after_a_failure_and_ends_at_twenty(run):
    printed = run("--cases", "0:10000", "-k", "squares")
    assert counts(printed, SQUARES) == (1908, 20)
    assert len(commands(printed)) == 20


def test_only_the_cases_that_are_asked_for_are_run(run):
    assert counts(run("--cases", "100:108", "-k", "squares"), SQUARES) == (8, 1)
    assert counts(run("--cases", "108:207", "-k", "squares"), SQUARES) == (99, 0)
    assert counts(run("--long", "--cases", "95:108", "-k", "squares"), SQUARES) == (13, 1)
    assert counts(run("--case", "107", "-k", "squares"), SQUARES) == (1, 1)


def test_two_processes_share_a_long_battery(run):
    printed = run("--long", "-n", "2", "--dist", "worksteal", "-v", "-k", "squares")
    assert counts(printed, SQUARES) == (1000, 10)
    assert "[gw0]" in printed
    assert "[gw1]" in printed


def test_a_known_share_of_the_cases_may_disagree_and_each_is_printed(run):
    printed = run("-k", "disagree")
    assert counts(printed, "test_few_disagree") == (100, 0)
    assert "1 disagree (1.00%; at most 1.00% may)" in printed
    assert "  pytest test_small.py::test_few_disagree --case 50  # why" in printed
    assert "odd: 50" in printed
    assert run("-k", "disagree", status=True) == 0
    assert run("-k", "disagree", "--cases", "0:99", status=True) == 1
    assert run("-k", "disagree", "--long", "-n", "2", "--dist", "load", status=True) == 1
