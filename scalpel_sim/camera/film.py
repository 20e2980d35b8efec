"""The frames of a film of a run, one after the other: the same to the byte each time."""

from collections.abc import Callable, Iterator

import numpy as np

from scalpel_sim.camera.camera import Camera
from scalpel_sim.camera.force_panel import ForcePanel
from scalpel_sim.simulation import Simulation


def film_frames(
    simulation: Simulation,
    camera: Camera,
    ends: Callable[[Simulation], float],
    *,
    interval: float,
    panel: ForcePanel | None = None,
    every_frame: Callable[[Simulation], None] = lambda simulation: None,
) -> Iterator[np.ndarray]:
    """Simulate a run, and yield what a camera sees of it: bytes, shape (height, width, 3).

    Args:
        simulation: The run, at its start.
        camera: A camera that sees it.
        ends: Returns when it ends [s], as is known then.
        interval: Simulated time from one picture to the next [s].
        panel: Plot beside the pictures; None: there is none.
        every_frame: Called after each frame of the simulation.
    """
    n_pictures = 0
    while True:
        while simulation.n_frames < round(n_pictures * interval / simulation.dt):
            if simulation.n_frames >= round(ends(simulation) / simulation.dt):
                return
            simulation.step()
            if panel is not None:
                panel.add_frame(simulation)
            every_frame(simulation)
        picture = camera.rgb()
        yield picture if panel is None else np.hstack([picture, panel.picture()])
        n_pictures += 1
