"""Checkpoints of a run: files with a checksum, which a thread writes during the frame loop."""

import hashlib
import logging
import os
import struct
import zlib
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple, Self

import msgspec

from scalpel_sim.recording.growing_file import FileSum
from scalpel_sim.runs.file_names import CHECKPOINT_FILES
from tissue import StateError
from tissue.support import whole_file

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
    record: str | None = None
    """File that it is recorded to."""
    read: dict[str, FileSum] = {}
    """Files of recorded motions that the run repeats, by path seen from its folder."""


class RunMark(
    msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="note", tag="mark"
):
    """Progress of a run."""

    n_frames: int
    """Number of frames that were done."""
    written: dict[str, FileSum]
    """Files that grow with the run, by name in its folder."""


def line_of(note: RunPlan | RunMark) -> bytes:
    """Return a note as a line of a journal: a checksum, and JSON."""
    content = msgspec.json.encode(note)
    return b"%08x %b\n" % (zlib.crc32(content), content)


def read_journal(path: Path) -> tuple[RunPlan | None, list[tuple[RunMark, int]]]:
    """Return the content of a journal. A line that is damaged, or not whole, is passed over.

    So is one of another version of the program.

    Returns:
        plan: The last plan; None: there is none whose checksum holds.
        marks: Marks whose checksum holds, in the order in which they were written, each with the
            place in the file at which its line ends [bytes].

    Raises:
        OSError: it cannot be read.
    """
    data = path.read_bytes() if path.exists() else b""
    plan, marks, end = None, [], 0
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
            marks.append((note, end))
    return plan, marks


_decoder: msgspec.json.Decoder[RunPlan | RunMark] = msgspec.json.Decoder(RunPlan | RunMark)


CHECKPOINT_SECONDS = 1.0
"""Simulated time between two checkpoints, where nothing is said of it [s]."""

_NAME = b"scalpel_sim checkpoint "
_MAGIC = _NAME + b"3\n"
"""The first line of the file; its number rises where the form changes."""

_DIGEST = 32
"""Length of the checksum [bytes]."""

_LENGTH = struct.Struct("<q")

_log = logging.getLogger(__name__)


class Checkpoint(NamedTuple):
    """A run at the end of a frame."""

    plan: RunPlan
    """Request of the run."""
    mark: RunMark
    """Progress of it."""
    state: bytes
    """See `SimulationState.to_bytes`."""

    def to_bytes(self) -> bytes:
        """Return the content of its file."""
        head = msgspec.json.encode(self[:2])
        content = b"".join((_LENGTH.pack(len(head)), head, self.state))
        return b"".join((_MAGIC, _digest(content), content))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Return the checkpoint in a file.

        Raises:
            StateError: it is none, or is not whole.
        """
        if data[: len(_NAME) + 1] in (_NAME + b"1", _NAME + b"2"):
            raise StateError("an earlier version of the program wrote it")
        begin = len(_MAGIC) + _DIGEST
        content = memoryview(data)[begin:]
        if not data.startswith(_MAGIC) or data[len(_MAGIC) : begin] != _digest(content):
            raise StateError("it is no checkpoint of this version, or a part is missing or damaged")
        (n_bytes,) = _LENGTH.unpack_from(content)
        end = _LENGTH.size + n_bytes
        head = msgspec.json.decode(content[_LENGTH.size : end], type=tuple[RunPlan, RunMark])
        return cls(*head, bytes(content[end:]))


def read_checkpoint(path: Path) -> Checkpoint | None:
    """Return the checkpoint in a file; None where there is none.

    Raises:
        StateError: it is not whole; the message names the file.
        OSError: it cannot be read.
    """
    try:
        return Checkpoint.from_bytes(path.read_bytes())
    except FileNotFoundError:
        return None
    except StateError as error:
        raise StateError(f"{path}: {error}") from error


def _digest(content: bytes | memoryview) -> bytes:
    """Return the checksum of a content."""
    return hashlib.blake2b(content, digest_size=_DIGEST).digest()


class Checkpoints:
    """Writes a checkpoint every so many frames, and keeps the last two.

    While one is written, no other is due. Where the system refuses, that is logged once, the run
    continues, and the last whole checkpoint stays.

    Args:
        folder: Where the files are, and those of an earlier run that continues.
        every: Frames between two; 0: there are none.
        grown: Names of files that grow with the run: they are on the disk before a checkpoint is.
    """

    def __init__(self, folder: Path, every: int = 0, grown: Sequence[str] = ()) -> None:
        self._folder, self._every, self._grown = folder, every, tuple(grown)
        self._frames: list[int | None] = [None, None]
        self._due = 0
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="checkpoint")
        self._written: Future[None] | None = None
        self._has_failed = False

    def read(self, *, is_said: bool = False) -> list[Checkpoint]:
        """Return the whole checkpoints of a run that continues, the last one first.

        Args:
            is_said: Whether those that are not whole have been logged; else they are.
        """
        found = []
        for slot, name in enumerate(CHECKPOINT_FILES):
            try:
                checkpoint = read_checkpoint(self._folder / name)
            except (StateError, OSError) as error:
                if not is_said:
                    _log.warning("%s; it is left out", error)
                continue
            if checkpoint is not None:
                self._frames[slot] = checkpoint.mark.n_frames
                found.append(checkpoint)
        return sorted(found, key=lambda each: -each.mark.n_frames)

    def cut_back(self, n_frames: int) -> None:
        """Continue after so many frames; the checkpoints of more, which were undone, go."""
        self.finish()
        for slot, name in enumerate(CHECKPOINT_FILES):
            n = self._frames[slot]
            if n is not None and n > n_frames:
                self._frames[slot] = None
                (self._folder / name).unlink(missing_ok=True)
        self._due = n_frames + (self._every if n_frames in self._frames else 0)

    @property
    def are_wanted(self) -> bool:
        """Whether there are to be checkpoints."""
        return self._every > 0

    @property
    def are_there(self) -> bool:
        """Whether there is a checkpoint."""
        return self._frames != [None, None]

    def is_due(self, n_frames: int) -> bool:
        """Return whether a checkpoint is to be written after so many frames."""
        is_free = self._written is None or self._written.done()
        return self.are_wanted and is_free and n_frames >= self._due

    def write(self, make: Callable[[], Checkpoint]) -> None:
        """Write a checkpoint, once the one before is written.

        Args:
            make: Makes it, before this returns.
        """
        self.finish()
        checkpoint = make()
        n_frames = checkpoint.mark.n_frames
        slot = min((0, 1), key=lambda each: -1 if (n := self._frames[each]) is None else n)
        self._frames[slot], self._due = n_frames, n_frames + self._every
        self._written = self._thread.submit(self._write, slot, checkpoint)

    def finish(self) -> None:
        """Wait until what is to be written is on the disk."""
        written, self._written = self._written, None
        if written is not None:
            written.result()

    def close(self) -> None:
        """End the thread, when it has written. May be called twice."""
        self._thread.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _write(self, slot: int, checkpoint: Checkpoint) -> None:
        """Write a checkpoint aside, and put it in its place when it is on the disk."""
        try:
            for name in self._grown:
                _put_on_disk(self._folder / name)
            with whole_file(self._folder / CHECKPOINT_FILES[slot]) as unfinished:
                unfinished.write_bytes(checkpoint.to_bytes())
            _put_on_disk(self._folder)
        except OSError as error:
            if not self._has_failed:
                _log.warning(
                    "%s: a checkpoint cannot be written (%s); the run continues, and the last one "
                    "that was written stays",
                    self._folder,
                    error.strerror or error,
                )
            self._has_failed = True


def _put_on_disk(path: Path) -> None:
    """Flush what a file, or the names in a folder, hold by now to the disk."""
    if not path.exists():
        return
    number = os.open(path, os.O_RDONLY)
    try:
        os.fsync(number)
    finally:
        os.close(number)
