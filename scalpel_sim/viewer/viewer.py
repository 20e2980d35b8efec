"""The live viewer: a web page that follows a run, served by another process."""

import contextlib
import os
import pickle
import subprocess
import sys
import threading
import time
from collections import deque
from collections.abc import Sequence
from types import TracebackType
from typing import IO, cast

import msgspec
import mujoco

from bridge import TissueFrame
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.hands.commands import Command, Release, command_of
from scalpel_sim.tables.view import ViewTable
from scalpel_sim.viewer.messages import (
    UPDATES_PER_SECOND,
    PageControls,
    SceneState,
    StartReply,
    ViewerSettings,
)
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.scene3d import LiveState, Readings
from tissue import FloatArray, Surface

START_TIMEOUT = 30.0
"""How long the viewer's process may take to start [s]. It usually takes half a second."""

CLOSE_TIMEOUT = 3.0
"""How long the viewer's process may take to end before it is killed [s]."""

HIGHEST_PORT = 65535
"""Largest port number of TCP."""

_PROGRAM = "from scalpel_sim.viewer.server import serve_page; serve_page()"
"""Program of the viewer's process."""


class Viewer:
    """Shows a run in any number of browser tabs, and never makes the run wait.

    A thread sends scene states through a pipe to another process, which serves them to the
    browsers. A state that comes while another is being sent replaces the state that waits. Tabs may
    be opened and closed, and the process may even end early, without disturbing the run.

    Attributes:
        url: Address of the page, which only this machine can open.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        title: str = "scalpel_sim",
        frame: TissueFrame | None = None,
        wireframe: bool = False,
        port: int | None = None,
        views: Sequence[ViewTable] = (),
        controls: PageControls | None = None,
    ) -> None:
        """Start the viewer's process and learn its address.

        Args:
            model: MuJoCo model whose shapes are shown.
            title: Heading of the page.
            frame: Pose of the tissue frame in the world; by default they coincide.
            wireframe: Whether the edges of the tissue's triangles are drawn at the start.
            port: Port of the page; None for the first free port.
            views: Cameras that the page offers, as a scene has them; it begins with the first.
            controls: What the page may do with the run; None: it shows, and controls nothing.

        Raises:
            UsageError: the port does not exist.
            RunError: the port is in use, or the process did not start.
        """
        if port is not None and not 1 <= port <= HIGHEST_PORT:
            raise UsageError(f"port {port} does not exist; ports go from 1 to {HIGHEST_PORT}")
        self._process = _start_process()  # it starts while the shapes are made here
        self._settings: ViewerSettings | None = ViewerSettings(
            title,
            list(shapes_of(model)),
            frame or TissueFrame(),
            wireframe,
            port,
            views,
            has_controls=controls is not None,
            is_led=controls is not None and controls.is_led,
            choices=None if controls is None else controls.choices,
        )
        self._pipe = cast(IO[bytes], self._process.stdin)
        self._changed = threading.Condition()
        self._waiting: SceneState | None = None
        self._is_closed = False
        self._listener: threading.Thread | None = None
        self._last_shown = -float("inf")
        self._sender = threading.Thread(target=self._send_states, name="viewer", daemon=True)
        self._sender.start()
        self.url = self._start_reply().url
        if controls is not None:
            self._listener = threading.Thread(
                target=self._listen, args=(controls.commands,), name="commands", daemon=True
            )
            self._listener.start()

    def __enter__(self) -> "Viewer":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
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
        return passed >= 1.0 / UPDATES_PER_SECOND and self.is_running

    def show(
        self,
        surface: Surface,
        body_poses: FloatArray,
        readings: Readings | None = None,
        live: LiveState | None = None,
    ) -> None:
        """Show the state of the scene. Returns immediately, whatever the viewer is doing.

        Args:
            surface: Surface of the body, tissue frame. Kept, not copied.
            body_poses: Poses of all bodies of the model, see `model_shapes.body_poses`.
            readings: Numbers to show beside the picture.
            live: How the run is, if the page controls it.
        """
        self._last_shown = time.monotonic()
        with self._changed:
            self._waiting = SceneState(surface, body_poses, readings, live)
            self._changed.notify()

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
        shapes = list(shapes_of(model))
        with self._changed:
            self._settings = ViewerSettings(
                title,
                shapes,
                frame,
                wireframe=False,
                port=None,
                views=views,
                has_controls=True,
                is_led=controls.is_led,
                choices=controls.choices,
            )
            self._waiting = None
            self._changed.notify()

    def close(self) -> None:
        """End the viewer's process. The pages keep showing the last state."""
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
                self._pipe.write(pickle.dumps(message, protocol=5))
                self._pipe.flush()
        except OSError:  # the process has ended
            pass
        finally:
            with contextlib.suppress(OSError):
                self._pipe.close()

    def _listen(self, commands: deque[Command]) -> None:
        """Receive commands until the process ends, and then let go."""
        for line in cast(IO[bytes], self._process.stdout):
            command = command_of(line)
            if command is not None:
                commands.append(command)
        commands.append(Release())

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
