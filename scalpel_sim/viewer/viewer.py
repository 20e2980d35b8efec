"""The live viewer: a web page that follows a run, served by a process of its own."""

import contextlib
import os
import pickle
import subprocess
import sys
import threading
import time
from types import TracebackType
from typing import IO, cast

import msgspec
import mujoco

from bridge import TissueFrame
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.viewer.messages import UPDATES_PER_SECOND, Greeting, Picture, Setting
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.scene3d import Readings
from tissue import FloatArray, Surface

START_TIMEOUT = 30.0
"""How long the viewer's process may take to say where it is [s]. Usually half a second."""

CLOSE_TIMEOUT = 3.0
"""How long it may take to end before it is killed [s]."""

HIGHEST_PORT = 65535


class Viewer:
    """Shows a run in any number of browser tabs, and never makes it wait.

    A picture is handed to a thread, which sends it down a pipe to another process, which draws up
    what the browsers need. A picture that comes while another is under way replaces the one that
    waits. Tabs come and go; the process may die: the run is not disturbed.

    Attributes:
        url: Address of the page, on this machine only.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        title: str = "scalpel_sim",
        frame: TissueFrame | None = None,
        wireframe: bool = False,
        port: int | None = None,
    ) -> None:
        """Start the viewer's process and learn its address.

        Args:
            model: Whose shapes are shown.
            title: Heading of the page.
            frame: Where the tissue lies in the world; by default at its origin.
            wireframe: Start with the edges of the tissue's triangles drawn.
            port: Where to listen; None for the first free port.

        Raises:
            UsageError: there is no such port.
            RunError: the port is in use, or the process did not start.
        """
        if port is not None and not 1 <= port <= HIGHEST_PORT:
            raise UsageError(f"port {port} does not exist; ports go from 1 to {HIGHEST_PORT}")
        setting = Setting(title, list(shapes_of(model)), frame or TissueFrame(), wireframe, port)
        self._process = _start_process()
        self._pipe = cast(IO[bytes], self._process.stdin)
        self._changed = threading.Condition()
        self._waiting: Setting | Picture | None = setting
        self._is_closed = False
        self._last_shown = -float("inf")
        self._sender = threading.Thread(target=self._send_pictures, name="viewer", daemon=True)
        self._sender.start()
        self.url = self._greeting().url

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
        """Whether the viewer's process lives. A run need not care: `show` is harmless if not."""
        return not self._is_closed and self._process.poll() is None

    def is_due(self) -> bool:
        """Return whether the pages can take a picture: at most `UPDATES_PER_SECOND` of wall time.

        Ask before extracting a surface, which costs far more than this.
        """
        passed = time.monotonic() - self._last_shown
        return passed >= 1.0 / UPDATES_PER_SECOND and self.is_running

    def show(
        self, surface: Surface, body_poses: FloatArray, readings: Readings | None = None
    ) -> None:
        """Show one instant. Returns at once, whatever the viewer is doing.

        Args:
            surface: Of the body, tissue frame. Kept, not copied.
            body_poses: Of all bodies of the model, see `model_shapes.body_poses`.
            readings: Numbers to show beside the picture.
        """
        self._last_shown = time.monotonic()
        with self._changed:
            self._waiting = Picture(surface, body_poses, readings)
            self._changed.notify()

    def close(self) -> None:
        """End the viewer's process. The pages keep the last picture."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        self._sender.join(CLOSE_TIMEOUT)
        if self._sender.is_alive():  # the process does not read any more
            self._process.kill()
        try:
            self._process.wait(CLOSE_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        cast(IO[bytes], self._process.stdout).close()

    def _send_pictures(self) -> None:
        """Send what waits until the viewer is closed or its process gone."""
        try:
            while True:
                with self._changed:
                    self._changed.wait_for(lambda: self._waiting is not None or self._is_closed)
                    picture, self._waiting = self._waiting, None
                if picture is None:
                    break
                self._pipe.write(pickle.dumps(picture, protocol=5))
                self._pipe.flush()
        except OSError:  # the process is gone
            pass
        finally:
            with contextlib.suppress(OSError):
                self._pipe.close()

    def _greeting(self) -> Greeting:
        """Wait for the process to say where it listens."""
        watchdog = threading.Timer(START_TIMEOUT, self._process.kill)
        watchdog.start()
        line = cast(IO[bytes], self._process.stdout).readline()
        watchdog.cancel()
        greeting = msgspec.json.decode(line, type=Greeting) if line else Greeting()
        if not greeting.url:
            self.close()
            reason = greeting.error or f"its process ended with code {self._process.returncode}"
            raise RunError(f"the viewer did not start: {reason}")
        return greeting


def _start_process() -> subprocess.Popen[bytes]:
    """Start the viewer's process.

    A process group of its own keeps it alive through the Ctrl-C that ends the run, so that the
    pages get the last picture. It ends when the pipe does, however the run came to its end.
    """
    return subprocess.Popen(
        [sys.executable, "-c", "from scalpel_sim.viewer.server import serve_page; serve_page()"],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        start_new_session=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
    )
