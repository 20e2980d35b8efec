"""The process that draws the plots of a run."""

import subprocess
import sys
import time
from pathlib import Path

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.output.plot_process import Plotter
from tests.support.processes import environment

DRAWS = """
import sys, time
from pathlib import Path
from scalpel_sim.output.plot_process import Plotter
folder, plotter = Path(sys.argv[1]), Plotter()
plotter.start(folder / "forces.csv", "title", folder / "late.png", folder / "later.png")
print(plotter._process.pid, flush=True)
time.sleep(60)
"""
"""A run that asks for its plots, and then does not end by itself."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    assert command_line(["run", "grid2", "-q", "--seconds", "0.01", "--out", str(folder)]) == 0
    return folder


def is_running(pid):
    state = Path(f"/proc/{pid}/stat")
    return state.exists() and state.read_text().rpartition(")")[2].split()[0] != "Z"


def test_plots_are_drawn_for_a_run_that_waits_for_them(recorded):
    pictures = (recorded / "a.png", recorded / "b.png")
    with Plotter() as plotter:
        plotter.start(recorded / "forces.csv", "title", *pictures)
        plotter.finish()
    assert all(picture.stat().st_size > 1000 for picture in pictures)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at processes in /proc")
def test_nothing_is_drawn_into_the_folder_of_a_run_that_was_killed(recorded):
    before = sorted(recorded.iterdir())
    run = subprocess.Popen(
        [sys.executable, "-c", DRAWS, str(recorded)],
        stdout=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    pid = int(run.stdout.readline())
    run.kill()
    run.communicate()
    while is_running(pid):
        time.sleep(0.02)
    assert sorted(recorded.iterdir()) == before
