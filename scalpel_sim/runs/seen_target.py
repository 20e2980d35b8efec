"""The camera of a task, which sees how much of its target is exposed while a run goes on."""

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from scalpel_sim.camera.camera import Camera
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.scoring.score import Score
from scalpel_sim.simulation import Simulation

_WIDTH, _HEIGHT = 160, 120
"""Pixels of a picture: a share is right to a ten-thousandth."""

_CUT = "cut "
"""Beginning of the name of the faces that cuts have made in a part."""


@contextmanager
def target_seen(simulation: Simulation, task: TaskTable | None) -> Iterator[None]:
    """Make the camera of a task, where it has one, look at its target at each control step.

    Raises:
        UsageError: there is no such camera.
        RenderError: nothing draws here.
    """
    score = simulation.score
    if task is None or task.camera is None or not isinstance(score, Score):
        yield
        return
    with Camera(simulation, task.camera, width=_WIDTH, height=_HEIGHT) as camera:
        names = (task.target, f"{_CUT}{task.target}")
        numbers = [number for name, number in camera.ids.items() if name in names]
        score.look_for_target = lambda: float(np.isin(camera.segmentation(), numbers).mean())
        try:
            yield
        finally:
            score.look_for_target = None
