"""The live page of an environment, for `render_mode="human"`."""

import time

from scalpel_sim.runs.console import say
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.pictures import into_viewer, show_in
from scalpel_sim.viewer.viewer import Viewer

_FARTHEST_BEHIND = 0.1
"""Time that is made up for at most [s]: a simulation that was slow does not hurry afterwards."""


class LivePage:
    """Shows a simulation in a browser, at its own pace or slower.

    Args:
        simulation: The simulation. From its next frame on it is shown.

    Raises:
        RunError: the process of the page did not start.
    """

    def __init__(self, simulation: Simulation) -> None:
        self._simulation = simulation
        views = () if simulation.scene is None else simulation.scene.views
        self._viewer = Viewer(
            simulation.arm.model, title=simulation.title, frame=simulation.frame, views=views
        )
        self._draw = into_viewer(self._viewer)
        simulation.pictures.append(self._draw)
        show_in(self._viewer, simulation)
        say(f"live at {self._viewer.url}")
        self._due = time.monotonic()

    @property
    def url(self) -> str:
        """Address of the page."""
        return self._viewer.url

    def wait(self, seconds: float) -> None:
        """Wait until a control step of so many seconds has passed since the last call."""
        now = time.monotonic()
        self._due = max(self._due + seconds, now - _FARTHEST_BEHIND)
        time.sleep(max(self._due - now, 0.0))

    def close(self) -> None:
        """End the page. May be called twice."""
        if self._draw in self._simulation.pictures:
            self._simulation.pictures.remove(self._draw)
        self._viewer.close()
