"""Memory that a run shares with the process that answers its device: a slot each way.

A slot has the newest record alone, so that neither side waits for the other, and a side that
stands still is behind by nothing when it goes on.
"""

import mmap
import struct
import zlib
from pathlib import Path
from typing import NamedTuple

import numpy as np

from bridge.device.felt_force import BladeReport
from bridge.device.messages import CartesianPose
from tissue import FloatArray

_CHECKSUM = struct.Struct("<I")

_TRIES = 5
"""Times that a record is read which the other side is writing. It takes a microsecond; a side that
was stopped meanwhile may take for ever, and then the record before counts."""


class DeviceCommand(NamedTuple):
    """Wish of the device."""

    hold: int
    """Number of the time that it has taken hold; 0: it does not hold the blade."""
    heard_at: float
    """When its last pose came, by the monotonic clock of the machine [s]."""
    period: float
    """Interval at which a pose is to come [s]."""
    has_ended: bool
    """Whether it has ended the stroke."""
    n_lost: int
    """Devices that have gone."""
    n_missed: int
    """Periods in which a device was to send a pose, and sent none."""
    n_dropped: int
    """Messages that were refused."""
    first: CartesianPose
    """Where the stylus was when it took hold."""
    stylus: CartesianPose
    """Where it is."""


NOTHING_WANTED = DeviceCommand(
    0,
    -np.inf,
    1.0,
    False,
    0,
    0,
    0,
    CartesianPose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])),
    CartesianPose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0])),
)
"""Wish before a device has come."""

_COMMAND_NUMBERS = 7 + 2 * 7
_REPORT_NUMBERS = 7 + 4 * 7 + 6 + 36


class _Slot:
    """Numbers with their checksum: a record that is half written is read again.

    Args:
        memory: Where it is.
    """

    def __init__(self, memory: memoryview) -> None:
        self._memory, self._last = memory, b""

    def write(self, content: bytes) -> None:
        self._memory[:] = _CHECKSUM.pack(zlib.crc32(content)) + content

    def read(self) -> bytes:
        """Return the newest record that is whole; nothing before the first one."""
        for _ in range(_TRIES):
            found = bytes(self._memory)
            content = found[_CHECKSUM.size :]
            if zlib.crc32(content) == _CHECKSUM.unpack_from(found)[0]:
                self._last = content
                break
        return self._last

    def close(self) -> None:
        self._memory.release()


class Exchange:
    """Both slots, in memory that is mapped from a file.

    Args:
        path: The file, of at least `SIZE` bytes; None: memory of this process alone.
    """

    SIZE = 2 * _CHECKSUM.size + 8 * (_COMMAND_NUMBERS + _REPORT_NUMBERS)

    def __init__(self, path: Path | None = None) -> None:
        if path is None:
            self._map = mmap.mmap(-1, self.SIZE)
        else:
            with path.open("r+b") as file:
                self._map = mmap.mmap(file.fileno(), self.SIZE)
        self._view = memoryview(self._map)
        split = _CHECKSUM.size + 8 * _COMMAND_NUMBERS
        self._commands, self._reports = _Slot(self._view[:split]), _Slot(self._view[split:])

    @property
    def command(self) -> DeviceCommand:
        """Wish of the device."""
        content = self._commands.read()
        if not content:
            return NOTHING_WANTED
        numbers = np.frombuffer(content)
        hold, heard_at, period, has_ended, n_lost, n_missed, n_dropped = numbers[:7].tolist()
        return DeviceCommand(
            int(hold),
            heard_at,
            period,
            bool(has_ended),
            int(n_lost),
            int(n_missed),
            int(n_dropped),
            _pose(numbers[7:14]),
            _pose(numbers[14:]),
        )

    @command.setter
    def command(self, command: DeviceCommand) -> None:
        self._commands.write(
            np.concatenate([command[:7], *command.first, *command.stylus]).tobytes()
        )

    @property
    def report(self) -> BladeReport | None:
        """State of the blade; None before the run has said so."""
        content = self._reports.read()
        if not content:
            return None
        numbers = np.frombuffer(content)
        stamp, time, factor, is_engaged, has_ended, n_limited, work = numbers[:7].tolist()
        measured, led, led_at_hold, stylus_at_hold = (
            _pose(part) for part in numbers[7:35].reshape(4, 7)
        )
        return BladeReport(
            stamp,
            time,
            factor,
            bool(is_engaged),
            bool(has_ended),
            int(n_limited),
            work,
            measured,
            numbers[35:41],
            numbers[41:].reshape(6, 6),
            led,
            led_at_hold,
            stylus_at_hold,
        )

    @report.setter
    def report(self, report: BladeReport) -> None:
        poses = (report.measured_cp, report.led, report.led_at_hold, report.stylus_at_hold)
        parts: list[FloatArray] = [part for pose in poses for part in pose]
        self._reports.write(
            np.concatenate([report[:7], *parts, report.wrench, report.stiffness.ravel()]).tobytes()
        )

    def close(self) -> None:
        """Release the memory."""
        self._commands.close()
        self._reports.close()
        self._view.release()
        self._map.close()


def _pose(numbers: FloatArray) -> CartesianPose:
    return CartesianPose(numbers[:3], numbers[3:])
