"""Writes the rows of a recording: the columns that all runs have by one call of a kernel."""

import math
from collections.abc import Sequence
from time import perf_counter
from typing import NamedTuple

import numpy as np

from scalpel_sim.recording.columns import (
    ACCOUNT,
    COLUMNS,
    ColumnGroup,
    FrameData,
    add_up,
    frame_row,
    move_moments,
)
from scalpel_sim.recording.recording import Recording
from tissue import FloatArray
from tissue.support import SameTypes, kernel

_Nine = tuple[float, float, float, float, float, float, float, float, float]
_Three = tuple[float, float, float]
_Six = tuple[float, float, float, float, float, float]

_SHARED = tuple(
    COLUMNS[name]
    for name in ("motion", "force_parts", "cut", "account", "added_mass", "wall_times")
)
"""The groups that a kernel writes, where they come first."""

_N_SHARED = sum(len(group.columns) for group in _SHARED)

_AT_ACCOUNT = 36
"""Where the account of energy begins in a row."""
_N_ACCOUNT = len(ACCOUNT)
_AT_ADDED_MASS = _AT_ACCOUNT + _N_ACCOUNT
"""Where the numbers of `tissue.AddedMass` begin."""
_STIFFNESS = 36
"""Numbers of a stiffness."""
_N_ADDED_MASS = len(COLUMNS["added_mass"].columns)
_AT_WALL_TIMES = _AT_ADDED_MASS + _N_ADDED_MASS

_NO_ACCOUNT = np.zeros(0)


class _OfResult(NamedTuple):
    """Numbers of a row that come from the result of a step."""

    normal: FloatArray
    normal_force: FloatArray
    friction: FloatArray
    at_end: FloatArray
    """`StepResult.numbers_at_end`."""
    account: FloatArray
    """No numbers without an account."""
    origin: _Three
    """Origin of the tissue in the world [m]."""
    cut_area: float
    finished_area: float
    n_tetrahedra: int
    anchored_length: float
    work_of_blade: float


class RowWriter:
    """Adds the rows of a run to its recording.

    Args:
        groups: Columns of the recording, in order.
        recording: The recording.
        is_parallel: Whether all results are of a tissue in this process whose frame is parallel to
            the world. Then a kernel writes the shared columns, from arrays that are there.
    """

    def __init__(
        self, groups: Sequence[ColumnGroup], recording: Recording, is_parallel: bool
    ) -> None:
        self._groups = groups
        self._others = groups[len(_SHARED) :]
        self._recording = recording
        self._has_kernel = is_parallel and tuple(groups[: len(_SHARED)]) == _SHARED
        self._write = SameTypes(_write)
        if self._has_kernel:
            # Compiled for floats, and before the first frame.
            none, nine, zeros = np.zeros((0, 3)), (0.0,) * 9, (0.0,) * 6
            at_end = np.zeros(_STIFFNESS + _N_ADDED_MASS)
            arrays = none, np.zeros(0), none, at_end, _NO_ACCOUNT
            result = _OfResult(*arrays, (0.0,) * 3, 0.0, 0.0, 0, 0.0, 0.0)
            self._write.call(np.zeros((1, _N_SHARED)), 0, 0.0, nine, nine, nine, result, zeros)

    def append(self, frame: FrameData) -> None:
        """Add the row of a frame.

        Raises:
            RunError: it cannot be written. The rows before are kept.
        """
        if not self._has_kernel:
            self._recording.append(frame_row(self._groups, frame))
            return
        result = frame.result
        contacts, account = result.contacts_of_blade, result.account
        room, at = self._recording.room_for_a_row()
        self._write.call(
            room,
            at,
            frame.time,
            frame.blade.numbers,
            frame.felt.numbers,
            frame.raw.numbers,
            _OfResult(
                contacts.normal,
                contacts.normal_force,
                contacts.friction,
                result.numbers_at_end,
                _NO_ACCOUNT if account is None else account,
                frame.tissue_frame.numbers_of_origin,
                result.cut_area,
                result.finished_area,
                result.n_tetrahedra,
                result.anchored_length,
                result.work_of_blade,
            ),
            (*frame.wall_times, perf_counter() - frame.recorded_since),
        )
        others = frame_row(self._others, frame) if self._others else ()
        self._recording.end_row(_N_SHARED, others)


@kernel
def _write(
    room: FloatArray,
    at: int,
    time: float,
    blade: _Nine,
    felt: _Nine,
    raw: _Nine,
    result: _OfResult,
    wall_times: _Six,
) -> None:
    """Write the columns of `_SHARED`.

    Args:
        room: Rows of the recording.
        at: The row.
        time: Time [s].
        blade: `FrameData.blade`.
        felt: `FrameData.felt`.
        raw: `FrameData.raw`.
        result: `FrameData.result`.
        wall_times: Wall times of the frame, and that of its recording so far [s].
    """
    row = room[at]
    row[0] = time
    for i in range(3):
        row[1 + i] = blade[i]
    for i in range(6):
        row[4 + i] = felt[i]
        row[10 + i] = raw[i]
    forward, at_end = (blade[6], blade[7], blade[8]), result.at_end
    add_up(result.normal, result.normal_force, result.friction, forward, row[16:25])
    for axis in range(3):
        row[25 + axis] = at_end[7 * axis]
    row[28], row[29], row[30] = at_end[1], at_end[2], at_end[8]
    row[31], row[32], row[33] = result.cut_area, result.finished_area, result.n_tetrahedra
    row[34], row[35] = result.anchored_length, result.work_of_blade
    account = result.account
    for i in range(_N_ACCOUNT):
        row[_AT_ACCOUNT + i] = account[1 + i] if len(account) > 0 else math.nan
    added = row[_AT_ADDED_MASS:_AT_WALL_TIMES]
    for i in range(len(added)):
        added[i] = at_end[_STIFFNESS + i]
    move_moments(added, result.origin)
    for i in range(6):
        row[_AT_WALL_TIMES + i] = wall_times[i]
