"""The live viewer: a web page that follows a run, served by another process."""

import contextlib
import math
import os
import pickle
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Mapping, Sequence
from typing import IO, TYPE_CHECKING, cast

import msgspec
import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.hands.commands import Release, command_of
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.colouring import wanted_of
from scalpel_sim.viewer.looks import ORGAN_LOOK
from scalpel_sim.viewer.messages import (
    MOST_ROWS_OF_FORCES,
    NO_VALUES,
    UPDATES_PER_SECOND,
    ForceRows,
    PageControls,
    SceneState,
    StartReply,
    ViewerSettings,
)
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.scene3d import JudgedState, LiveState, Readings
from tissue import FloatArray, Surface, SurfaceQuantity

if TYPE_CHECKING:  # importing it takes half a second
    from meshcat import Visualizer

    from scalpel_sim.viewer.meshcat_scene import MeshcatScene

START_TIMEOUT = 30.0
"""Time in which the viewer's process is to start [s]. It usually takes half a second."""

CLOSE_TIMEOUT = 3.0
"""Time in which the viewer's process is to end, before it is killed [s]."""

HIGHEST_PORT = 65535
"""Largest port number of TCP."""

NO_BODIES = np.zeros((0, 7))
"""Poses of the bodies of no model."""

_PROGRAM = "from scalpel_sim.viewer.server import serve_page; serve_page()"
"""Program of the viewer's process."""


class Viewer:
    """Shows a run in any number of browser tabs, and never makes the run wait.

    A thread sends scene states through a pipe to another process, which serves them to the
    browsers. A state that comes while another is being sent replaces the state that waits. Tabs may
    be opened and closed, and the process may even end early, without disturbing the run.

    Attributes:
        url: Address of the page, which only this machine can open.
        wanted: Quantities that pages show as colours now: give `show` their values.
    """

    def __init__(
        self,
        model: mujoco.MjModel | None = None,
        *,
        title: str = "scalpel_sim",
        frame: TissueFrame | None = None,
        wireframe: bool = False,
        port: int | None = None,
        views: Sequence[ViewTable] = (),
        controls: PageControls | None = None,
        visualizer: "Visualizer | None" = None,
    ) -> None:
        """Start the viewer's process and learn its address.

        Args:
            model: MuJoCo model whose shapes are shown; None for the tissue alone.
            title: Heading of the page.
            frame: Pose of the tissue frame in the world; by default they coincide.
            wireframe: Whether the edges of the tissue's triangles are drawn at the start.
            port: Port of the page; None for the first free port.
            views: Cameras that the page offers, as a scene has them; it begins with the first.
            controls: What the page may do with the run; None: it shows, and controls nothing.
            visualizer: A scene of meshcat, or a part of one, into which tissue, shapes and force
                are drawn too. It stays its owner's: what else is in it is left alone.

        Raises:
            UsageError: the port does not exist, or `visualizer` is none.
            RunError: the port is in use, or the process did not start.
        """
        if port is not None and not 1 <= port <= HIGHEST_PORT:
            raise UsageError(f"port {port} does not exist; ports go from 1 to {HIGHEST_PORT}")
        self._scene: MeshcatScene | None = None
        if visualizer is not None:
            from scalpel_sim.viewer import meshcat_scene

            meshcat_scene.expect_visualizer(visualizer)
        self._process = _start_process()  # it starts while the shapes are made here
        at = frame or TissueFrame()
        settings = _settings_of(model, title, at, views, controls)
        self._settings: ViewerSettings | None = settings._replace(wireframe=wireframe, port=port)
        self._pipe = cast(IO[bytes], self._process.stdin)
        self._changed = threading.Condition()
        self._waiting: SceneState | None = None
        self._forces: deque[tuple[float, ...]] = deque(maxlen=MOST_ROWS_OF_FORCES)
        self._is_closed = False
        self._listener: threading.Thread | None = None
        self.wanted: frozenset[SurfaceQuantity] = frozenset()
        self._shown: SceneState | None = None
        self._last_shown = -float("inf")
        self._sender = threading.Thread(target=self._send_states, name="viewer", daemon=True)
        self._sender.start()
        self.url = self._start_reply().url
        self._listener = threading.Thread(
            target=self._listen, args=(controls,), name="commands", daemon=True
        )
        self._listener.start()
        if visualizer is not None:
            self._scene = meshcat_scene.MeshcatScene(visualizer, settings.shapes, at)

    def __enter__(self) -> "Viewer":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    @property
    def is_running(self) -> bool:
        """Whether the viewer's process runs. If it does not, `show` does nothing."""
        return not self._is_closed and self._process.poll() is None

    def is_due(self) -> bool:
        """Return whether it is time for an update: at most `UPDATES_PER_SECOND` in wall time.

        Call it before extracting a surface, which takes far longer.
        """
        passed = time.monotonic() - self._last_shown
        is_seen = self.is_running or (self._scene is not None and self._scene.is_drawn)
        return passed >= 1.0 / UPDATES_PER_SECOND and is_seen

    def add_forces(self, time: float, *newtons: float) -> None:
        """Plot the forces of a frame, with the next state that is shown.

        Args:
            time: Simulated time [s].
            newtons: Size of the force on the blade, and on each grasper [N].
        """
        self._forces.append((time, *newtons))

    def show(
        self,
        surface: Surface,
        body_poses: FloatArray = NO_BODIES,
        readings: Readings | None = None,
        live: LiveState | None = None,
        values: Mapping[SurfaceQuantity, FloatArray] = NO_VALUES,
        judged: JudgedState | None = None,
    ) -> None:
        """Show the state of the scene. Returns immediately, whatever the viewer is doing.

        Args:
            surface: Surface of the body, tissue frame. Kept, not copied.
            body_poses: Poses of all bodies of the model, see `model_shapes.body_poses`.
            readings: Numbers to show next to the picture.
            live: How the run is, if the page controls it.
            values: The quantities `wanted`, at the vertices of the surface, SI.
            judged: Plan and score of the run; None: it has no task.
        """
        self._last_shown = time.monotonic()
        if readings is not None:
            on_graspers = (force for _, force in readings.hands)
            self.add_forces(readings.time, math.hypot(*readings.force), *on_graspers)
        with self._changed:
            state = self._waiting = SceneState(surface, body_poses, readings, live, values, judged)
            self._changed.notify()
        self._shown = state
        if self._scene is not None:
            self._scene.show(state)

    @property
    def lacks_values(self) -> bool:
        """Whether a page wants to show a quantity that the last state did not have."""
        return self._shown is not None and not self.wanted <= self._shown.values.keys()

    def begin(
        self,
        model: mujoco.MjModel,
        *,
        title: str,
        frame: TissueFrame,
        controls: PageControls,
        views: Sequence[ViewTable] = (),
    ) -> None:
        """Show another run in the same page.

        Args:
            model: MuJoCo model whose shapes are shown.
            title: Heading of the page.
            frame: Pose of the tissue frame in the world.
            controls: What the page may do with the run; its commands go where they went.
            views: Cameras that the page offers; it begins with the first.
        """
        settings = _settings_of(model, title, frame, views, controls)
        with self._changed:
            self._settings, self._waiting = settings, None
            self._forces.clear()
            self._changed.notify()

    def close(self) -> None:
        """End the viewer's process. The pages keep showing the last state."""
        if self._scene is not None:
            self._scene.close()
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        self._sender.join(CLOSE_TIMEOUT)
        if self._sender.is_alive():  # the process has stopped reading
            self._process.kill()
        try:
            self._process.wait(CLOSE_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        if self._listener is not None:
            self._listener.join()  # the process has ended, and with it what is listened to
        cast(IO[bytes], self._process.stdout).close()

    def _send_states(self) -> None:
        """Send the states that wait, until the viewer is closed or its process has ended."""
        try:
            while True:
                with self._changed:
                    self._changed.wait_for(
                        lambda: self._settings or self._waiting or self._is_closed
                    )
                    message: ViewerSettings | SceneState | None
                    if self._settings is not None:
                        message, self._settings = self._settings, None
                    else:
                        message, self._waiting = self._waiting, None
                if message is None:
                    break
                if isinstance(message, SceneState) and self._forces:
                    rows = [self._forces.popleft() for _ in range(len(self._forces))]
                    self._pipe.write(pickle.dumps(ForceRows(rows), protocol=5))
                self._pipe.write(pickle.dumps(message, protocol=5))
                self._pipe.flush()
        except OSError:  # the process has ended
            pass
        finally:
            with contextlib.suppress(OSError):
                self._pipe.close()

    def _listen(self, controls: PageControls | None) -> None:
        """Receive what pages want to see, and commands, until the process ends; then release."""
        for line in cast(IO[bytes], self._process.stdout):
            wanted = wanted_of(line)
            if wanted is not None:
                self.wanted = frozenset(wanted.quantities)
            elif controls is not None and (command := command_of(line)) is not None:
                controls.commands.append(command)
        if controls is not None:
            controls.commands.append(Release())

    def _start_reply(self) -> StartReply:
        """Wait for the first line of the process: the address of its page, or an error."""
        watchdog = threading.Timer(START_TIMEOUT, self._process.kill)
        watchdog.start()
        line = cast(IO[bytes], self._process.stdout).readline()
        watchdog.cancel()
        reply = msgspec.json.decode(line, type=StartReply) if line else StartReply()
        if not reply.url:
            self.close()
            reason = reply.error or f"its process ended with code {self._process.returncode}"
            raise RunError(f"the viewer did not start: {reason}")
        return reply


def _settings_of(
    model: mujoco.MjModel | None,
    title: str,
    frame: TissueFrame,
    views: Sequence[ViewTable],
    controls: PageControls | None,
) -> ViewerSettings:
    """Return the settings of a run, for the viewer's process."""
    return ViewerSettings(
        title,
        [] if model is None else list(shapes_of(model)),
        frame,
        views=views,
        has_controls=controls is not None,
        is_led=controls is not None and controls.is_led,
        choices=None if controls is None else controls.choices,
        look=ORGAN_LOOK if controls is None else controls.look,
    )


def _start_process() -> subprocess.Popen[bytes]:
    """Start the viewer's process.

    It is in a process group of its own, so that the Ctrl-C that ends the run does not end it and
    the pages still get the last state. It ends when the pipe is closed, however the run ended.
    """
    return subprocess.Popen(
        [sys.executable, "-c", _PROGRAM],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
    )
