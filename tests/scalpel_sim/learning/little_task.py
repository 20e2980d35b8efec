"""A task that takes a second: a gel slab is cut along a line."""

from pathlib import Path

import pytest

from scalpel_sim import read_scene

SCENE = """
[body]
shape = "block"
size = [0.06, 0.03, 0.012]
cells = [12, 6, 3]
fixed = "bottom"

[[stroke]]
kind = "traced"
points = [[0.02, 0.014, 0.012], [0.04, 0.016, 0.012]]
depth = 0.005

[[grasper]]
name = "left"
preset = "touch"
motion = [
    { time = 0.0, at = [0.11, 0.015, 0.05], opening = 0.01 },
    { time = 0.3, at = [0.11, 0.015, 0.04] },
]

[task]
line = [[0.02, 0.014], [0.04, 0.016]]
depth = 0.005
seconds = 3.0
success = { covered = 0.9, off_plan = 40e-6 }

[task.reward]
covered = 10.0
off_plan = -1e5
success = 5.0

[observe]
state = ["blade", "wrench", "wrench_peak", "target", "depth", "left", "points:8"]
cameras = [{ name = "overview", size = [48, 36], segmentation = true }]
"""


@pytest.fixture(scope="session")
def little_task(tmp_path_factory):
    path: Path = tmp_path_factory.mktemp("task") / "little.toml"
    path.write_text(SCENE)
    return read_scene(path)
