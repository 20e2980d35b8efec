"""The replay: one HTML file in which one plays the cut, without a network or this program."""

import base64
import gzip
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import mujoco

from bridge import TissueFrame
from scalpel_sim.viewer.model_shapes import shapes_of
from scalpel_sim.viewer.page import replay_page
from scalpel_sim.viewer.scene3d import Readings
from scalpel_sim.viewer.scene_packets import Stage
from tissue import FloatArray, Surface

FRAMES_PER_SECOND = 25.0
"""Of simulated time, as long as the file stays small enough. A film has 24."""

FILE_LIMIT = 18_000_000
"""Bytes that the frames may take in the file. Above about 20 MB a page opens slowly, and most
mail servers refuse it."""

BYTES_PER_TRIANGLE = 55
"""What a triangle takes in the file: measured 38 to 50 on cut blocks and organs, compressed and
in base64. Only the number of frames that are kept hangs on it."""

_CAPTION = (
    "Skin: red-brown, with vessels. Bright red: what the blade has laid open. Arrow: the force "
    "that the blade feels; blue lines: of each contact, thirty times as long. Drag "
    "to turn, scroll to zoom."
)


class _Frame(NamedTuple):
    """One instant of the run."""

    time: float
    surface: Surface
    body_poses: FloatArray
    readings: Readings | None


class ReplayWriter:
    """Keeps pictures of a run and writes them as one page.

    Bodies with many triangles get fewer frames a second, so that the file stays small: when the
    frames grow too heavy, every second one is dropped, and from then on half as many are taken.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        *,
        title: str = "scalpel_sim",
        frame: TissueFrame | None = None,
        wireframe: bool = False,
    ) -> None:
        """Prepare a replay.

        Args:
            model: Whose shapes are shown.
            title: Heading of the page.
            frame: Where the tissue lies in the world; by default at its origin.
            wireframe: Start with the edges of the tissue's triangles drawn.
        """
        self._stage = Stage(shapes_of(model), frame, wireframe=wireframe)
        self._title = title
        self._frames: list[_Frame] = []
        self._interval = 1.0 / FRAMES_PER_SECOND
        self._last: _Frame | None = None

    def is_due(self, time: float) -> bool:
        """Return whether a frame at this simulated time [s] would be kept.

        Ask before extracting a surface, which costs far more than this.
        """
        return not self._frames or time >= self._frames[-1].time + 0.999 * self._interval

    def add(
        self,
        time: float,
        surface: Surface,
        body_poses: FloatArray,
        readings: Readings | None = None,
    ) -> None:
        """Offer one instant. It is kept if enough time has passed, or if it is the last.

        Args:
            time: Simulated time [s].
            surface: Of the body, tissue frame. Kept, not copied.
            body_poses: Of all bodies of the model, see `model_shapes.body_poses`.
            readings: Numbers to show beside the picture.
        """
        frame = _Frame(time, surface, body_poses, readings)
        if not self.is_due(time):
            self._last = frame
            return
        self._last = None
        self._frames.append(frame)
        n_triangles = sum(len(frame.surface.triangles) for frame in self._frames)
        if n_triangles * BYTES_PER_TRIANGLE > FILE_LIMIT and len(self._frames) > 2:
            self._frames = self._frames[::2]
            self._interval *= 2.0

    def write(self, path: Path) -> None:
        """Write the page.

        Raises:
            ValueError: there is nothing to show, because no frame was added.
            OSError: the file cannot be written.
        """
        frames = [*self._frames, *([self._last] if self._last is not None else [])]
        if not frames:
            raise ValueError("the replay has no frames: add at least one before writing it")
        path.write_text(
            replay_page(self._title, _CAPTION, "\n".join(self._elements(frames))), encoding="utf-8"
        )

    def _elements(self, frames: list[_Frame]) -> Iterator[str]:
        """Yield the script elements that hold the run: the opening, then the frames."""
        opening = self._stage.opening(frames[0].surface, frames[0].body_poses)
        yield _script(opening, frames[0].time)
        for frame in frames:
            packet = self._stage.frame(frame.surface, frame.body_poses, frame.readings)
            yield _script(packet, frame.time)


def _script(packet: bytes, time: float) -> str:
    """Return a packet as an element that a browser keeps without looking into it."""
    packed = base64.b64encode(gzip.compress(packet, compresslevel=1, mtime=0)).decode("ascii")
    return f'<script type="text/plain" class="packet" data-time="{time!r}">{packed}</script>'
