"""Runs that are killed in this process, go on, and are compared with whole ones."""

import json
from collections import deque

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.resumption import resumption_of
from scalpel_sim.runs.run import perform
from scalpel_sim.runs.run_folder import Outputs
from scalpel_sim.scene.read import read_scene
from tests.scalpel_sim.hands.driven_runs import controls_of, through_the_body
from tests.support.run_files import untimed

EVERY = 0.1
"""Simulated time between two checkpoints [s]."""

WALL = ("wall_seconds", "real_time_factor", "frame_rate_median", "frame_rate_p99", "share")
"""Figures of a summary that differ from run to run."""


class Killed(BaseException):
    """End of a run at once, as by a kill."""


def at(n_frames):
    """Return a callback that ends a run after so many frames."""

    def kill(simulation):
        if len(simulation.recording) == n_frames:
            raise Killed

    return kill


def perform_in(folder, scene, simulation=None, resumption=None, **others):
    """Do a run in a folder."""
    simulation = prepare(scene) if simulation is None else simulation
    with Plotter() as plotter:
        columns = simulation.recording.columns
        outputs = Outputs(folder, plotter, columns, checkpoint_seconds=EVERY, resumption=resumption)
        settings = {"scene": scene.name}
        seconds = scene.seconds
        return perform(
            simulation, outputs, scene=scene, settings=settings, seconds=seconds, **others
        )


def kill_in(folder, scene, n_frames, **others):
    """Do a run that is killed after so many frames."""
    with pytest.raises(Killed):
        perform_in(folder, scene, every_frame=at(n_frames), **others)


def resume_in(folder, **others):
    """Go on with a run in a folder."""
    return perform_in(
        folder, read_scene(folder / "scene.toml"), None, resumption_of(folder), **others
    )


def physics(folder):
    """Return the columns of `forces.csv` but wall times."""
    return untimed(read_forces(folder / "forces.csv"))


def figures(folder):
    """Return the figures of `summary.json` but wall times."""
    summary = json.loads((folder / "summary.json").read_text())
    return {key: value for key, value in summary.items() if key not in WALL}


def expect_same(folder, whole):
    """Compare the files of two runs."""
    assert np.array_equal(physics(folder), physics(whole), equal_nan=True)
    assert figures(folder) == figures(whole)
    for name in ("initial.vtu", "final.vtu", "scene.toml", "replay.html"):
        assert (folder / name).read_bytes() == (whole / name).read_bytes(), name


def led(folder, n_frames, *commands):
    """Do a run that a hand leads, and that is killed; what it does is drawn from a seed.

    Args:
        folder: Where its files go.
        n_frames: Frames after which it is killed.
        commands: Commands of a page, each after the number of frames after which it comes.
    """
    scene = SCENES["grid2"]
    simulation = prepare(scene, is_led=True)
    hand = LiveHand(simulation, seconds=10.0, clock=lambda: 0.0)
    controls = controls_of(simulation, hand)
    lead, kill, later = through_the_body(hand), at(n_frames), deque(commands)

    def after_frame(now):
        lead(now)
        if later and later[0][0] == len(now.recording):
            controls.commands.append(later.popleft()[1])
        kill(now)

    with pytest.raises(Killed):
        perform_in(folder, scene, simulation, every_frame=after_frame, controls=controls)
