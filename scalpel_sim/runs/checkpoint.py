"""`Checkpoint`: all that a run needs to go on in another process, as one file with a checksum."""

import hashlib
import struct
from pathlib import Path
from typing import NamedTuple, Self

import msgspec

from scalpel_sim.runs.run_notes import RunMark, RunPlan
from tissue import StateError

_MAGIC = b"scalpel_sim checkpoint 2\n"
"""The first line of the file; its number rises where the form changes."""

_WITHOUT_SUMS = b"scalpel_sim checkpoint 1\n"
"""The first line of the form that had no checksums of the other files."""

_DIGEST = 32
"""Length of the checksum [bytes]."""

_LENGTH = struct.Struct("<q")


class CheckpointHead(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a checkpoint says beside the state."""

    plan: RunPlan
    """Request of the run."""
    mark: RunMark
    """How far it had got."""


class Checkpoint(NamedTuple):
    """A run at the end of a frame."""

    head: CheckpointHead
    state: bytes
    """See `SimulationState.to_bytes`."""

    def to_bytes(self) -> bytes:
        """Return the content of its file."""
        head = msgspec.json.encode(self.head)
        content = b"".join((_LENGTH.pack(len(head)), head, self.state))
        return b"".join((_MAGIC, _digest(content), content))

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Return the checkpoint in a file.

        Raises:
            StateError: it is none, or is not whole.
        """
        if data.startswith(_WITHOUT_SUMS):
            raise StateError(
                "an earlier version of the program wrote it, without checksums of the other files"
            )
        begin = len(_MAGIC) + _DIGEST
        content = memoryview(data)[begin:]
        if not data.startswith(_MAGIC) or data[len(_MAGIC) : begin] != _digest(content):
            raise StateError("it is no checkpoint of this version, or a part is missing or damaged")
        (n_bytes,) = _LENGTH.unpack_from(content)
        end = _LENGTH.size + n_bytes
        head = msgspec.json.decode(content[_LENGTH.size : end], type=CheckpointHead)
        return cls(head, bytes(content[end:]))


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
