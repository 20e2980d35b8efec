"""The recorded reports of a SpaceMouse, and a mouse that plays them."""

import struct
import time
from pathlib import Path
from types import SimpleNamespace

FULL = 350.0
"""Deflection that the mouse reports for a full one."""

REPORTS = [
    (1e-3 * float(milliseconds), bytes.fromhex(report))
    for milliseconds, report in (
        line.split(",")
        for line in Path(__file__).with_name("spacemouse.csv").read_text().splitlines()
        if not line.startswith("#")
    )
]
"""When each came [s], and its bytes."""


def take_report(reading, report):
    """Put what a report says into a reading, as `pyspacemouse` does with HID_Z_UP."""
    kind, numbers = report[0], report[1:]
    if kind == 3:
        reading.buttons = [numbers[0] & 1, numbers[0] >> 1 & 1]
        return
    x, y, z = (number / FULL for number in struct.unpack("<3h", numbers[:6]))
    if kind == 1:
        reading.x, reading.y, reading.z = x, -y, -z
    else:
        reading.roll, reading.pitch, reading.yaw = x, -y, -z


class PlayedSpaceMouse:
    """Reads one report at a time, once its time has come, as a mouse does.

    Its clock goes on while the one who reads it sleeps, and at no other time.
    """

    def __init__(self):
        self.reading = SimpleNamespace(
            t=-1.0, x=0.0, y=0.0, z=0.0, roll=0.0, pitch=0.0, yaw=0.0, buttons=[0, 0]
        )
        self._reports, self._now = list(REPORTS), 0.0

    def clock(self):
        return self._now

    def sleep(self, seconds):
        time.sleep(seconds)
        self._now += seconds

    def read(self):
        if self._reports and self._now >= self._reports[0][0]:
            self.reading.t, report = self._reports.pop(0)
            take_report(self.reading, report)
        return self.reading
