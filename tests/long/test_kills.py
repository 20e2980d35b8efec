"""A run is ended by kill -9, SIGTERM or Ctrl-C at a random instant; what was done is whole."""

import re
import signal
import tempfile
import time
from pathlib import Path

import numpy as np
import pytest

from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.file_names import ENERGY_PLOT, RUN_FILES
from tests.long.forked_runs import ForkedRuns, count_in
from tests.support.battery import battery
from tests.support.processes import start
from tests.support.run_files import names_in
from tests.support.whole_runs import broken_files

MOST_LOST = 100
"""Frames of a millisecond that a kill may cost."""

SAID = re.compile(
    r"error: interrupted by SIG(INT|TERM)"
    r"( before the run began; no file was written"
    r"| after [\d.]+ s; \S+ holds what was done(; --resume \S+ continues from there)?"
    r"| when the run was complete; \S+ holds what was done)?$"
)
"""Messages of a run that a signal ended."""


@pytest.fixture(scope="module")
def forked_runs():
    with ForkedRuns() as runs:
        yield runs


IN_PYTHON = "Could not import runpy module"
"""What Python says of Ctrl-C when it does not run the program yet."""


def wait_for(program, condition):
    while program.poll() is None and not condition():
        time.sleep(0.002)


@battery(n_per_change=6, n_long=1_000)
def test_a_run_that_is_killed_at_any_instant_leaves_whole_files(case, forked_runs):
    random = np.random.default_rng(case)
    number = random.choice([signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
    instant = ("start", "frames", "writing")[case % 3]
    # The process that draws outlives a run that is killed for as long as it draws.
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder, count = Path(name) / "run", Path(name) / "count"
        seconds = {"start": 0.05, "frames": 1000.0, "writing": random.uniform(0.01, 0.3)}[instant]
        words = ("run", "grid2", "-q", "--seconds", str(seconds), "--out", str(folder))
        is_counted = instant != "start"  # that is of a program that loads itself
        program = forked_runs.start(count, *words) if is_counted else start(*words)
        if not is_counted:
            time.sleep(random.uniform(0.0, 3.0))
        elif instant == "frames":
            wait_for(program, lambda: count_in(count) > 0)
            time.sleep(random.exponential(0.3))
        else:
            wait_for(program, lambda: count_in(count) >= seconds * 1e3 - 1)
            time.sleep(random.uniform(0.0, 1.0))
        was_running = program.poll() is None
        program.send_signal(number)
        _, err = program.communicate(timeout=120)
        assert not broken_files(folder)
        forces = folder / "forces.csv"
        n_rows = len(read_forces(forces)) if forces.exists() and forces.stat().st_size else 0
        if program.returncode == 0:
            assert instant != "frames"
            assert names_in(folder) == sorted(RUN_FILES)
        elif number == signal.SIGKILL:
            assert program.returncode == -number and was_running
            assert not is_counted or count_in(count) - n_rows <= MOST_LOST
        elif program.returncode == -number or IN_PYTHON in err:  # before Python runs the program
            assert instant == "start" and not folder.exists()
        else:
            assert program.returncode == 1, err
            assert SAID.search(err.splitlines()[-1]) and "Traceback" not in err, err
            assert not is_counted or n_rows == count_in(count)
            if "holds" in err.splitlines()[-1]:
                # Without a frame there is no account of energy to draw.
                assert names_in(folder) == sorted(
                    {*RUN_FILES} - ({ENERGY_PLOT} if not n_rows else set())
                )
