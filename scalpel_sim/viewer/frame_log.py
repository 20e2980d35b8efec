"""`FrameLog`: frames of a replay, in a file that grows with the run."""

import struct
from pathlib import Path
from typing import NamedTuple, Self

import msgspec

from scalpel_sim.recording.growing_file import FileSum
from scalpel_sim.recording.recording import unnamed_file
from scalpel_sim.viewer.messages import SceneState
from scalpel_sim.viewer.packing import array_of, pack

_HEAD = struct.Struct("<dqq")
"""Time [s], number of triangles, and length of what follows [bytes]."""


class LoggedFrame(NamedTuple):
    """Where a frame is."""

    time: float
    """Simulated time [s]."""
    n_triangles: int
    """Triangles of its surface."""
    begin: int
    """Where it begins in the file [bytes]."""
    n_bytes: int
    """Length of the frame there [bytes]."""


class FrameLog:
    """Frames of a replay, one after the other, as MessagePack.

    Args:
        path: The file, which is gone on with if it is there; None: a temporary one.
        kept: How much of a file that is there is gone on with.

    Raises:
        OSError: the file cannot be made, or is shorter.
    """

    def __init__(self, path: Path | None = None, kept: FileSum = FileSum()) -> None:
        self.path = path
        """Where it is; None: it has no name."""
        mode = "r+b" if kept.n_bytes else "w+b"
        self._file = unnamed_file() if path is None else path.open(mode, buffering=0)
        self.sum = kept
        """Length and checksum of the file."""
        if self._file.seek(0, 2) < kept.n_bytes:
            raise OSError(f"{path} has fewer than {kept.n_bytes} bytes: a part of it is missing")
        self.cut_back(kept)

    def add(self, time: float, state: SceneState) -> LoggedFrame:
        """Add a frame.

        Raises:
            OSError: the file cannot be written.
        """
        content = pack(state)
        n_triangles = len(state.surface.triangles)
        data = _HEAD.pack(time, n_triangles, len(content)) + content
        begin = self.sum.n_bytes + _HEAD.size
        self._file.seek(self.sum.n_bytes)
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]
        self.sum = self.sum.after(data)
        return LoggedFrame(time, n_triangles, begin, len(content))

    def frames(self) -> list[LoggedFrame]:
        """Return where all frames are."""
        found, begin = [], 0
        while begin < self.sum.n_bytes:
            self._file.seek(begin)
            time, n_triangles, n_bytes = _HEAD.unpack(self._file.read(_HEAD.size))
            found.append(LoggedFrame(time, n_triangles, begin + _HEAD.size, n_bytes))
            begin += _HEAD.size + n_bytes
        return found

    def read(self, frame: LoggedFrame) -> SceneState:
        """Return a frame."""
        self._file.seek(frame.begin)
        return _decoder.decode(self._file.read(frame.n_bytes))

    def cut_back(self, mark: FileSum) -> None:
        """Forget what was added after `sum` was this."""
        self._file.truncate(mark.n_bytes)
        self.sum = mark

    def close(self) -> None:
        """Close the file, which stays where it has a name. May be called twice."""
        self._file.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


_decoder = msgspec.msgpack.Decoder(SceneState, dec_hook=array_of)
