"""The plots of a run, and the process that draws them."""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from scalpel_sim.cli.app import command_line
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.plots import (
    HAND_COLOURS,
    LIMITED,
    OPACITY,
    PARTS,
    plot_energies,
    plot_forces,
)
from scalpel_sim.recording.recording import TERMS
from scalpel_sim.runs.file_names import ENERGY_PLOT, PLOT
from scalpel_sim.runs.run_folder import Outputs
from tests.scalpel_sim.runs.test_run_folder import recorded, recording_of_hands, zero_recording
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
def run_folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    assert command_line(["run", "grid2", "-q", "--seconds", "0.01", "--out", str(folder)]) == 0
    return folder


def is_running(pid):
    state = Path(f"/proc/{pid}/stat")
    return state.exists() and state.read_text().rpartition(")")[2].split()[0] != "Z"


def test_plots_are_drawn_for_a_run_that_waits_for_them(run_folder):
    pictures = (run_folder / "a.png", run_folder / "b.png")
    with Plotter() as plotter:
        plotter.start(run_folder / "forces.csv", "title", *pictures)
        plotter.finish()
    assert all(picture.stat().st_size > 1000 for picture in pictures)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks at processes in /proc")
def test_nothing_is_drawn_into_the_folder_of_a_run_that_was_killed(run_folder):
    before = sorted(run_folder.iterdir())
    run = subprocess.Popen(
        [sys.executable, "-c", DRAWS, str(run_folder)],
        stdout=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    pid = int(run.stdout.readline())
    run.kill()
    run.communicate()
    while is_running(pid):
        time.sleep(0.02)
    assert sorted(run_folder.iterdir()) == before


def test_the_plot_is_a_picture_that_shows_the_force(tmp_path):
    image = pytest.importorskip("PIL.Image")
    with Plotter() as plotter:
        outputs = Outputs(tmp_path, plotter)
        outputs.write_forces(recorded(50), all_rows=True)
        outputs.start_plots("block: straight stroke")
        outputs.finish_plots()
    with image.open(tmp_path / PLOT) as picture:
        pixels = np.asarray(picture.convert("RGB"))
    assert pixels.shape[0] > 500 and pixels.shape[1] > 800
    assert (pixels == (0x22, 0x22, 0x22)).all(axis=2).sum() > 500  # the magnitude's line


def test_the_plot_shows_what_the_force_is_made_of_and_where_the_device_limits_it(tmp_path):
    plain, limited = zero_recording(), zero_recording()
    for name in ("force_z_n", "tissue_force_z_n"):
        plain.column(name)[:] = limited.column(name)[:] = 2.0
    limited.column("tissue_force_z_n")[50:] = 4.0
    edge = zero_recording()
    edge.column("edge_force_x_n")[:] = 1.0
    plot_forces(plain, "plain", tmp_path / "plain.png")
    plot_forces(limited, "limited", tmp_path / "limited.png")
    plot_forces(edge, "edge", tmp_path / "edge.png")
    assert n_of_colour(tmp_path / "plain.png", LIMITED) < n_of_colour(
        tmp_path / "limited.png", LIMITED
    )
    (_, _, edge_colour), *_ = PARTS
    assert n_of_colour(tmp_path / "edge.png", edge_colour) > 500


def test_heights_in_the_energy_plot_are_energies(tmp_path):
    recording = zero_recording()
    recording.column("work_of_blade_j")[:] = 3e-3
    recording.column("cutting_j")[:] = 2e-3
    recording.column("damping_j")[:] = 1e-3
    plot_energies(recording, "block", tmp_path / ENERGY_PLOT)
    cutting, damping = (
        n_of_colour(tmp_path / ENERGY_PLOT, on_white(colour_of(name)))
        for name in ("cutting", "damping")
    )
    assert cutting > 10_000
    assert cutting == pytest.approx(2 * damping, rel=0.1)


def test_the_labels_of_the_energy_plot_are_whole_however_small_the_residual_is(tmp_path):
    recording = zero_recording()
    recording.column("work_of_blade_j")[:] = 1.0
    recording.column("residual_j")[:] = np.linspace(0.0, -4e-5, 100)  # ticks such as -0.004 %
    plot_energies(recording, "block", tmp_path / ENERGY_PLOT)
    picture = imread(tmp_path / ENERGY_PLOT)
    assert (picture[:, :4] == 1.0).all(), "the left edge is white"


def n_of_colour(path: Path, colour: str) -> int:
    """Return the number of pixels of a picture that have nearly a given colour."""
    image = pytest.importorskip("PIL.Image")
    with image.open(path) as picture:
        pixels = np.asarray(picture.convert("RGB"), int)
    wanted = [int(colour[i : i + 2], 16) for i in (1, 3, 5)]
    return int((np.abs(pixels - wanted).max(axis=2) <= 3).sum())


def colour_of(name: str) -> str:
    return next(term.colour for term in TERMS if term.name == name)


def on_white(colour: str) -> str:
    """Return how a colour of the stack appears on a white background."""
    channels = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    seen = (round(OPACITY * channel + (1.0 - OPACITY) * 255) for channel in channels)
    return "#" + "".join(f"{channel:02x}" for channel in seen)


def test_the_picture_of_the_forces_has_a_line_for_each_grasper(tmp_path):
    plain, with_hand = tmp_path / "plain.png", tmp_path / "hand.png"
    plot_forces(zero_recording(30), "one hand", plain)
    plot_forces(recording_of_hands("left", n_frames=30), "two hands", with_hand)
    assert n_of_colour(with_hand, HAND_COLOURS[0]) > 100 + n_of_colour(plain, HAND_COLOURS[0])
