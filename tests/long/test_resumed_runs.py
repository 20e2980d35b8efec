"""A run that is killed at a random instant, and resumed, ends as one that was not."""

import json
import shutil
import signal
import tempfile
from pathlib import Path
from time import sleep

import numpy as np
import pytest

from scalpel_sim.output.run_outcome import COMPLETE
from scalpel_sim.recording.recording import read_forces
from tests.scalpel_sim.output.killed_runs import figures, physics
from tests.support.battery import battery
from tests.support.processes import start

RUN = ("run", "slab", "--seconds", "0.6", "--quiet", "--out")
LONGEST_WAIT = 120.0
"""Time until which a run has begun [s]."""


def finish(*words):
    """Run the program to its end."""
    program = start(*words)
    out, errors = program.communicate(timeout=600.0)
    assert program.returncode == 0, (words, out, errors)


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole")
    finish(*RUN, str(folder))
    return folder


def killed_after(folder, n_bytes, seconds, every):
    """Begin a run, and kill it some time after its table has some length; return whether it was."""
    program = start(*RUN, str(folder), "--checkpoint", f"{every:.3f}")
    forces = folder / "forces.csv"
    for _ in range(round(LONGEST_WAIT / 0.005)):
        if program.poll() is not None or (forces.exists() and forces.stat().st_size >= n_bytes):
            break
        sleep(0.005)
    sleep(seconds)
    program.send_signal(signal.SIGKILL)
    program.communicate()
    return program.returncode == -signal.SIGKILL and not is_complete(folder)


def is_complete(folder):
    """Return whether a run had written all of its files, and only its process was there yet."""
    summary = folder / "summary.json"
    return summary.exists() and json.loads(summary.read_text())["status"] == COMPLETE


@battery(n_per_change=2, n_long=100)
def test_a_run_that_is_killed_and_resumed_ends_as_one_that_was_not(case, whole):
    rng = np.random.default_rng(case)
    folder = Path(tempfile.mkdtemp())
    try:
        n_bytes, seconds = rng.integers(1, 400_000), rng.uniform(0.0, 0.1)
        if not killed_after(folder, n_bytes, seconds, rng.choice([0.05, 0.1, 0.3])):
            return  # it was complete before
        n_before = len(read_forces(folder / "forces.csv"))
        finish("run", "--resume", str(folder), "--quiet")
        assert len(physics(folder)) >= n_before
        assert np.array_equal(physics(folder), physics(whole), equal_nan=True)
        assert figures(folder) == figures(whole)
        for name in ("final.vtu", "scene.toml", "replay.html"):
            assert (folder / name).read_bytes() == (whole / name).read_bytes(), name
    finally:
        shutil.rmtree(folder)
