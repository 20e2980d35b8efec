"""The replay: one HTML file that plays a run in any browser, without a network."""

import base64
import gzip
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path

import mujoco

from bridge import TissueFrame
from scalpel_sim.errors import RunError
from scalpel_sim.recording.growing_file import FileSum
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.viewer.frame_log import FrameLog, LoggedFrame
from scalpel_sim.viewer.looks import ORGAN_LOOK, Look
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.model_shapes import Shape, shapes_of
from scalpel_sim.viewer.page import replay_page
from scalpel_sim.viewer.scene_packets import ScenePackets

FRAMES_PER_SECOND = 25.0
"""Frames kept per second of simulated time, as long as the file stays small enough."""

FILE_LIMIT = 18_000_000
"""Largest size of the frames in the file [bytes]. Above about 20 MB a page opens slowly, and most
mail servers refuse it."""

BYTES_PER_TRIANGLE = 55
"""Size of one triangle in the file, compressed and in base64 [bytes]. Measured: 38 to 50 on cut
blocks and organs. Only the number of frames that are kept depends on it."""

_COLOURS = "Red-brown: skin. Bright red: faces of the cut. "
_CAPTION = (
    "Arrow: force on the blade. Blue lines: contact forces, magnified thirty times. Drag to turn "
    "the view, scroll to zoom."
)
"""Text below the heading of a replay."""


_PLACE = "<!-- the packets of the run -->"
"""Stands in the page for what is written one frame after the other."""


class ReplayWriter:
    """Keeps frames of a run in a file, and writes them as one page.

    Bodies with many triangles get fewer frames per second, so that the file stays small: when the
    frames take too much space, every second one is dropped, and from then on half as many are kept.
    """

    def __init__(
        self,
        model: mujoco.MjModel | Sequence[Shape],
        *,
        title: str = "scalpel_sim",
        frame: TissueFrame | None = None,
        wireframe: bool = False,
        views: Sequence[ViewTable] = (),
        log: FrameLog | None = None,
        look: Look = ORGAN_LOOK,
    ) -> None:
        """Prepare a replay.

        Args:
            model: MuJoCo model whose shapes are shown, or these shapes.
            title: Heading of the page.
            frame: Pose of the tissue frame in the world; by default they coincide.
            wireframe: Whether the edges of the tissue's triangles are drawn at the start.
            views: Cameras that the page offers, as a scene has them; it begins with the first.
            log: Holds its frames, and those of the run so far; None: a temporary file does.
            look: Look of the body's material.
        """
        self._model = model
        self._title = title
        self._tissue_frame = frame
        self._wireframe = wireframe
        self._views = tuple(views)
        self._look = look
        self._log = FrameLog() if log is None else log
        self._last: tuple[float, SceneState] | None = None
        self._frames: list[LoggedFrame] = []
        self._interval = 1.0 / FRAMES_PER_SECOND
        self._read_log()

    def is_due(self, time: float) -> bool:
        """Return whether a frame at this simulated time [s] would be kept.

        Call it before extracting a surface, which takes far longer.
        """
        return not self._frames or time >= self._frames[-1].time + 0.999 * self._interval

    def add(self, time: float, state: SceneState) -> None:
        """Add a frame, which is kept if enough time has passed, or if no other frame follows.

        Args:
            time: Simulated time [s].
            state: What the frame shows. Kept, not copied; the page offers its values as colours.

        Raises:
            RunError: the file of the frames cannot be written.
        """
        if not self.is_due(time):
            self._last = time, state
            return
        self._last = None
        try:
            self._keep(self._log.add(time, state))
        except OSError as error:
            where = self._log.path or tempfile.gettempdir()
            raise RunError(
                f"{where}: the frames of the replay cannot be written there "
                f"({error.strerror or error}); make room"
            ) from error

    def _keep(self, frame: LoggedFrame) -> None:
        """Keep a frame, and fewer of all where they take too much space."""
        self._frames.append(frame)
        n_triangles = sum(frame.n_triangles for frame in self._frames)
        if n_triangles * BYTES_PER_TRIANGLE > FILE_LIMIT and len(self._frames) > 2:
            self._frames = self._frames[::2]
            self._interval *= 2.0

    def _read_log(self) -> None:
        """Keep of the frames in the file those that were kept when the last of them came."""
        self._frames, self._interval = [], 1.0 / FRAMES_PER_SECOND
        for frame in self._log.frames():
            self._keep(frame)

    def mark(self) -> FileSum:
        """Return how far the file of the frames has got."""
        return self._log.sum

    def cut_back(self, mark: FileSum) -> None:
        """Forget the frames that were added after a mark."""
        self._log.cut_back(mark)
        self._last = None
        self._read_log()

    def write(self, path: Path) -> None:
        """Write the page.

        Raises:
            ValueError: no frame was added.
            RunError: meshcat's viewer was not found.
            OSError: the file cannot be written.
        """
        if not (self._frames or self._last):
            raise ValueError("the replay has no frames: add at least one before writing it")
        caption = ("" if self._look.labels else _COLOURS) + _CAPTION
        head, tail = replay_page(self._title, caption, _PLACE).split(_PLACE)
        with path.open("w", encoding="utf-8") as file:
            file.write(head)
            for i, element in enumerate(self._elements()):
                file.write(element if i == 0 else f"\n{element}")
            file.write(tail)

    def _all(self) -> Iterator[tuple[float, SceneState]]:
        """Yield time [s] and content of all frames, of which one is in memory."""
        for frame in self._frames:
            yield frame.time, self._log.read(frame)
        if self._last is not None:
            yield self._last

    def _elements(self) -> Iterator[str]:
        """Yield the script elements that hold the run: the opening packet, then the frames."""
        # The shapes are made here and not at the start, which loading trimesh would delay by 0.3 s.
        is_model = isinstance(self._model, mujoco.MjModel)
        shapes = shapes_of(self._model) if is_model else self._model
        packets = ScenePackets(
            shapes,
            self._tissue_frame,
            wireframe=self._wireframe,
            views=self._views,
            look=self._look,
        )
        for i, (time, state) in enumerate(self._all()):
            if i == 0:
                yield _script(packets.opening(state.surface, state.body_poses), time)
            yield _script(packets.frame(state), time)


def _script(packet: bytes, time: float) -> str:
    """Return a packet as an element that a browser keeps as it is."""
    packed = base64.b64encode(gzip.compress(packet, compresslevel=1, mtime=0)).decode("ascii")
    return f'<script type="text/plain" class="packet" data-time="{time!r}">{packed}</script>'
