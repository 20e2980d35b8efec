"""Folders of runs of a little task: one that a script did, and one that a hand led."""

from pathlib import Path

import pytest

from scalpel_sim import prepare, read_scene
from scalpel_sim.hands.commands import Choose, Engage, Jaws
from scalpel_sim.hands.teleoperation import LiveHand
from tests.scalpel_sim.hands.driven_runs import Clock, controls_of, done, move

LED_SECONDS = 0.4
"""Time for which the hand leads [s]."""

SCENE = """
about = "cut the slab along a line"

[body]
shape = "block"
size = [0.03, 0.016, 0.01]
cells = [6, 4, 2]
fixed = "bottom"

[[stroke]]
kind = "traced"
points = [[0.01, 0.008, 0.01], [0.02, 0.008, 0.01]]
depth = 0.004
speed = 0.08

[[grasper]]
name = "left"
preset = "touch"
motion = [
    { time = 0.0, at = [0.08, 0.008, 0.05], opening = 0.01 },
    { time = 0.3, at = [0.08, 0.008, 0.04] },
]

[task]
line = [[0.01, 0.008], [0.02, 0.008]]
depth = 0.004
seconds = 3.0
success = { covered = 0.9, off_plan = 40e-6 }

[task.reward]
covered = 10.0
off_plan = -1e5
success = 5.0

[[vary]]
what = "material.toughness"
range = [0.8, 1.2]

[observe]
state = ["blade", "wrench", "wrench_peak", "target", "depth", "left", "points:8"]
cameras = [{ name = "overview", size = [48, 36], segmentation = true }]
"""


@pytest.fixture(scope="session")
def slab_task(tmp_path_factory):
    """Return a task that takes a second."""
    path: Path = tmp_path_factory.mktemp("task") / "slab_task.toml"
    path.write_text(SCENE)
    return read_scene(path)


@pytest.fixture(scope="session")
def script_folder(slab_task, tmp_path_factory):
    """Return the folder of a run in which the script of the scene does its task."""
    folder = tmp_path_factory.mktemp("script")
    done(prepare(slab_task), folder, slab_task)
    return folder


@pytest.fixture(scope="session")
def led_folder(slab_task, tmp_path_factory):
    """Return the folder of a run in which a hand lowers the blade, and then closes the grasper."""
    folder = tmp_path_factory.mktemp("led")
    simulation = prepare(slab_task, is_led=True)
    hand = LiveHand(simulation, seconds=LED_SECONDS, clock=Clock())
    hand.commands.append(Engage())

    def command(now):
        n = now.n_frames
        if n % 16 == 0 and n < 200:
            hand.commands.append(move(x=2e-4, z=-1e-3, stamp=float(n)))
        if n == 250:
            hand.commands += [Choose(1), Jaws(True)]

    controls = controls_of(simulation, hand)
    done(simulation, folder, slab_task, controls=controls, every_frame=command)
    return folder
