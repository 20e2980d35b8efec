"""Writes the rows of a recording: the columns of the blade by one call of a kernel."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.recording.columns import COLUMNS, ColumnGroup, FrameData, add_up, frame_row
from scalpel_sim.recording.recording import Recording
from tissue import FloatArray
from tissue.support import SameTypes, kernel

_Nine = tuple[float, float, float, float, float, float, float, float, float]
_Five = tuple[float, float, float, float, float]

_OF_BLADE = tuple(COLUMNS[name] for name in ("motion", "force_parts", "cut"))
"""The groups that a kernel writes, where they come first."""

_N_OF_BLADE = sum(len(group.columns) for group in _OF_BLADE)


class _AtBlade(NamedTuple):
    """Contacts of the blade, and their stiffness."""

    normal: FloatArray
    normal_force: FloatArray
    friction: FloatArray
    stiffness: FloatArray


class RowWriter:
    """Adds the rows of a run to its recording.

    Args:
        groups: Columns of the recording, in order.
        recording: The recording.
        is_parallel: Whether all results are of a tissue in this process whose frame is parallel to
            the world. Then a kernel writes the columns of the blade, from arrays that are there.
    """

    def __init__(
        self, groups: Sequence[ColumnGroup], recording: Recording, is_parallel: bool
    ) -> None:
        self._groups = groups
        self._others = groups[len(_OF_BLADE) :]
        self._recording = recording
        self._has_kernel = is_parallel and tuple(groups[: len(_OF_BLADE)]) == _OF_BLADE
        self._write = SameTypes(_write)
        if self._has_kernel:
            # Compiled for floats, and before the first frame.
            none, nine = np.zeros((0, 3)), (0.0,) * 9
            at_blade = _AtBlade(none, np.zeros(0), none, np.zeros((6, 6)))
            self._write.call(
                np.zeros((1, _N_OF_BLADE)), 0, 0.0, nine, nine, nine, at_blade, (0.0,) * 5
            )

    def append(self, frame: FrameData) -> None:
        """Add the row of a frame.

        Raises:
            RunError: it cannot be written. The rows before are kept.
        """
        if not self._has_kernel:
            self._recording.append(frame_row(self._groups, frame))
            return
        result = frame.result
        contacts = result.contacts_of_blade
        room, at = self._recording.room_for_a_row()
        self._write.call(
            room,
            at,
            frame.time,
            frame.blade.numbers,
            frame.felt.numbers,
            frame.raw.numbers,
            _AtBlade(contacts.normal, contacts.normal_force, contacts.friction, result.stiffness),
            (
                result.cut_area,
                result.finished_area,
                result.n_tetrahedra,
                result.anchored_length,
                result.work_of_blade,
            ),
        )
        self._recording.end_row(_N_OF_BLADE, frame_row(self._others, frame))


@kernel
def _write(
    room: FloatArray,
    at: int,
    time: float,
    blade: _Nine,
    felt: _Nine,
    raw: _Nine,
    at_blade: _AtBlade,
    cut: _Five,
) -> None:
    """Write the columns of `_OF_BLADE`.

    Args:
        room: Rows of the recording.
        at: The row.
        time: Time [s].
        blade: `FrameData.blade`.
        felt: `FrameData.felt`.
        raw: `FrameData.raw`.
        at_blade: Contacts of the blade.
        cut: What it has done so far.
    """
    row = room[at]
    row[0] = time
    for i in range(3):
        row[1 + i] = blade[i]
    for i in range(6):
        row[4 + i] = felt[i]
        row[10 + i] = raw[i]
    forward, stiffness = (blade[6], blade[7], blade[8]), at_blade.stiffness
    add_up(at_blade.normal, at_blade.normal_force, at_blade.friction, forward, row[16:25])
    for axis in range(3):
        row[25 + axis] = stiffness[axis, axis]
    row[28] = stiffness[0, 1]
    row[29] = stiffness[0, 2]
    row[30] = stiffness[1, 2]
    for i in range(5):
        row[31 + i] = cut[i]
