"""Journal of a run: its notes on itself, from which another process can continue it."""

import zlib
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from scalpel_sim.recording.growing_file import FileSum

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
    seconds: float | None
    """Length of the run [s]; None: as long as a hand leads it."""
    read: dict[str, FileSum] = {}
    """Files of recorded motions that the run repeats, by path seen from its folder."""


class RunMark(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="note", tag="mark"
):
    """How far a run had got."""

    n_frames: int
    """Number of frames that were done."""
    written: dict[str, FileSum]
    """Files that grow with the run, by name in its folder."""


class Noted(NamedTuple):
    """Content of a journal."""

    plan: RunPlan | None
    """The last plan; None: there is none whose checksum holds."""
    marks: list[RunMark]
    """Marks whose checksum holds, in the order in which they were written."""
    ends: list[int]
    """Where in the file the line of each mark ends [bytes]."""


def line_of(note: RunPlan | RunMark) -> bytes:
    """Return a note as a line of a journal: a checksum, and JSON."""
    content = msgspec.json.encode(note)
    return b"%08x %b\n" % (zlib.crc32(content), content)


def read_journal(path: Path) -> Noted:
    """Return the content of a journal. A line that is damaged, or not whole, is passed over.

    So is one of another version of the program.

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
        try:
            note = _decoder.decode(content)
        except msgspec.ValidationError:
            continue
        if isinstance(note, RunPlan):
            plan = note
        else:
            marks.append(note)
            ends.append(end)
    return Noted(plan, marks, ends)


_decoder: msgspec.json.Decoder[RunPlan | RunMark] = msgspec.json.Decoder(RunPlan | RunMark)
