"""Journal of a run: its notes on itself, from which another process can continue it."""

import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from scalpel_sim.recording.growing_file import FileSum, GrowingFile

_CRC = 8
"""Digits of the checksum of a line."""


class RunPlan(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="note", tag="plan"
):
    """Request of a run."""

    dt: float
    """Simulated time of a frame [s]."""
    scene: str | None
    """Text of its `scene.toml`; None: there is none."""
    exports: list[str]
    """Files for the body's surface after the run."""
    settings: dict[str, Any]
    """Settings, as the summary has them."""


class RunMark(
    msgspec.Struct,
    frozen=True,
    forbid_unknown_fields=True,
    omit_defaults=True,
    tag_field="note",
    tag="mark",
):
    """How far a run had got."""

    n_frames: int
    """Frames that were done."""
    seconds: float | None
    """How long the run is to last [s]; None: as long as what a hand does, which leads it."""
    written: dict[str, FileSum]
    """Files that grow with the run, by name in its folder."""
    read: dict[str, FileSum] = {}
    """Files of recorded motions that the run repeats, by path seen from its folder."""


class Noted(NamedTuple):
    """Content of a journal."""

    plan: RunPlan | None
    """The last plan; None: there is none whose checksum holds."""
    marks: list[RunMark]
    """Marks whose checksum holds, in the order in which they were written."""
    ends: list[int]
    """Where in the file the line of each mark ends [bytes]."""


class RunJournal:
    """Notes of a run, with the checksums of its other files. It is written after them.

    Args:
        path: The file.
        plan: What the run was asked for.
        seconds: How long it is to last [s]; None: as long as what a hand does, which leads it.
        read: Files of recorded motions that it repeats, by path seen from its folder.
        n_kept: How much is kept of a file that is there [bytes].

    Raises:
        OSError: the system refuses.
    """

    def __init__(
        self,
        path: Path,
        plan: RunPlan,
        seconds: float | None,
        read: Mapping[str, FileSum],
        n_kept: int = 0,
    ) -> None:
        self.plan = plan
        self._seconds, self._read = seconds, dict(read)
        self.file = GrowingFile(path, b"", FileSum(n_kept))
        self.file.append(line_of(plan))

    def mark(self, n_frames: int, written: Mapping[str, FileSum]) -> RunMark:
        """Return how far the run has got.

        Args:
            n_frames: Frames that were done.
            written: Files that grow with the run, by name.
        """
        return RunMark(n_frames, self._seconds, dict(written), self._read)


def line_of(note: RunPlan | RunMark) -> bytes:
    """Return a note as a line of a journal: a checksum, and JSON."""
    content = msgspec.json.encode(note)
    return b"%08x %b\n" % (zlib.crc32(content), content)


def read_journal(path: Path) -> Noted:
    """Return what a journal holds. A line that is damaged, or not whole, is passed over.

    Raises:
        OSError: it cannot be read.
    """
    data = path.read_bytes() if path.exists() else b""
    plan, marks, ends, end = None, [], [], 0
    for line in data.split(b"\n"):
        end += len(line) + 1
        crc, content = line[:_CRC], line[_CRC + 1 :]
        if crc != b"%08x" % zlib.crc32(content):
            continue
        note = _decoder.decode(content)
        if isinstance(note, RunPlan):
            plan = note
        else:
            marks.append(note)
            ends.append(end)
    return Noted(plan, marks, ends)


_decoder: msgspec.json.Decoder[RunPlan | RunMark] = msgspec.json.Decoder(RunPlan | RunMark)
