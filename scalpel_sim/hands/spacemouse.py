"""A SpaceMouse as a device that leads the blade: its deflection is a speed."""

import math
import time
from collections.abc import Callable, Sequence
from typing import Protocol

import mujoco
import numpy as np

from bridge import DeviceClient, DeviceState

SPACEMOUSE_PERIOD = 4e-3
"""Interval at which a pose is sent [s]: twice as often as the mouse reports, motion and turning in
turn."""

FULL_SPEED = 0.05
"""Speed of the tip at full deflection [m/s]: that of an unhurried incision."""

FULL_TURN_RATE = 0.5
"""Turn rate at full deflection [rad/s]."""

DEAD_ZONE = 0.05
"""Share of full deflection that counts as none: a cap at rest reports up to some hundredths."""

LONGEST_GAP = 0.05
"""Longest time between two readings that counts in full [s], so that a pause is no leap."""

LET_GO_BUTTON, END_BUTTON = 0, 1
"""The left button releases while it is pressed, the right one ends the run."""


class SpaceMouseReading(Protocol):
    """Deflection of the cap and its buttons, as `pyspacemouse` reads them with HID_Z_UP.

    Axes are right-handed and go from -1 to 1: x to the right, y away from the person, z up; roll,
    pitch and yaw turn about them.
    """

    t: float
    """When the last report was read [s]."""
    x: float
    y: float
    z: float
    roll: float
    pitch: float
    yaw: float
    buttons: Sequence[int]


class SpaceMouseStylus:
    """The stylus that a SpaceMouse moves; it begins at the origin, unturned."""

    def __init__(self) -> None:
        self.position = np.zeros(3)
        """[m], world frame, shape (3,)."""
        self.orientation = np.array([1.0, 0.0, 0.0, 0.0])
        """Unit quaternion (w, x, y, z)."""

    def move(self, reading: SpaceMouseReading, seconds: float) -> None:
        """Move and turn for so long [s] as the cap is deflected."""
        axes = (reading.x, reading.y, reading.z)
        turns = (reading.roll, reading.pitch, reading.yaw)
        self.position += seconds * FULL_SPEED * np.array([_beyond_dead_zone(a) for a in axes])
        turn, before = np.array([1.0, 0.0, 0.0, 0.0]), self.orientation.copy()
        spin = FULL_TURN_RATE * np.array([_beyond_dead_zone(a) for a in turns])
        mujoco.mju_quatIntegrate(turn, spin, seconds)
        mujoco.mju_mulQuat(self.orientation, turn, before)
        mujoco.mju_normalize4(self.orientation)


def lead_by_spacemouse(
    client: DeviceClient,
    read: Callable[[], SpaceMouseReading],
    clock: Callable[[], float] = time.monotonic,
    sleep: Callable[[float], None] = time.sleep,
) -> DeviceState:
    """Lead the blade until the run has ended, and return how it then is.

    Args:
        client: Leads the blade.
        read: Reads a report, if one has come, and returns at once.
        clock: Wall time [s].
        sleep: Waits for so many seconds.

    Raises:
        LinkError: the run did not answer.
    """
    stylus, before = SpaceMouseStylus(), clock()
    while True:
        reading, now = _newest(read), clock()
        stylus.move(reading, min(now - before, LONGEST_GAP))
        before = now
        holds = not _is_pressed(reading, LET_GO_BUTTON)
        state = client.servo_cp(stylus.position, stylus.orientation, holds=holds)
        if _is_pressed(reading, END_BUTTON):
            state = client.end()
        if state.has_ended:
            return state
        sleep(max(0.0, now + SPACEMOUSE_PERIOD - clock()))


def _newest(read: Callable[[], SpaceMouseReading]) -> SpaceMouseReading:
    """Read all reports that have come, so that none waits where the run is slow."""
    before, reading = None, read()
    while reading.t != before:
        before, reading = reading.t, read()
    return reading


def _is_pressed(reading: SpaceMouseReading, button: int) -> bool:
    return len(reading.buttons) > button and bool(reading.buttons[button])


def _beyond_dead_zone(deflection: float) -> float:
    """Return a deflection that is zero in the dead zone, and grows from zero at its edge."""
    beyond = max(0.0, min(abs(deflection), 1.0) - DEAD_ZONE) / (1.0 - DEAD_ZONE)
    return math.copysign(beyond, deflection)
