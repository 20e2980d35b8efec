"""Runs that a fake device leads over a real socket, in a thread beside the run."""

import contextlib
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bridge import DeviceClient, LinkError
from scalpel_sim import prepare
from scalpel_sim.runs.device_run import DeviceRun, device_run
from scalpel_sim.runs.options import DeviceOptions
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.scene.scene import changed
from tests.scalpel_sim.hands.driven_runs import GRID2

PERIOD = 1e-3
"""Period of the fake device [s]."""

SPEED = 0.02
"""Speed of its stylus [m/s]."""

FRAMES_PER_LOOK = 20
"""Frames after which it is looked whether the device has done what it was to do."""

UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])


@dataclass
class FrameSeen:
    """What was seen after a frame."""

    wall: float
    """When it was done, by the monotonic clock [s]."""
    is_engaged: bool
    tip: np.ndarray
    """Where the hand leads the tip [m]."""


class WatchedRun:
    """A run that a device may lead, of which each frame is noted."""

    def __init__(self, prepared: PreparedRun, led: DeviceRun) -> None:
        self.simulation, self.led = prepared.simulation, led
        self.frames: list[FrameSeen] = []
        self.address = led.answers.address
        self.simulation.blade.controller = led.hand

    def run(self, seconds: float) -> None:
        """Do frames of so many simulated seconds at real-time speed."""
        hand, controls = self.led.hand, self.led.controls
        controls.pace.go_on()

        def note(now) -> None:
            self.frames.append(FrameSeen(time.monotonic(), hand.is_engaged, hand.tip))
            hand.tell()
            controls.pace.wait(now.dt)
            while controls.obey():
                pass

        self.simulation.run(self.simulation.time + seconds, note)

    def run_beside(self, act: Callable[[], None]) -> None:
        """Run while a device does something in a thread, and some frames longer."""
        self.frames.clear()
        with beside(act) as thread:
            while thread.is_alive():
                self.run(FRAMES_PER_LOOK * self.simulation.dt)
            self.run(3.0 * FRAMES_PER_LOOK * self.simulation.dt)

    def led_after(self, wall: float) -> float:
        """Return for how long after that time frames began in which the hand was led [s]."""
        begins = [wall, *(frame.wall for frame in self.frames)]
        led = [a for a, frame in zip(begins, self.frames, strict=False) if frame.is_engaged]
        return max(led, default=wall) - wall


@contextlib.contextmanager
def watched_run(folder, **options):
    """Yield a run of a small body at its start, at which a device can connect."""
    scene = changed(GRID2, relaxation="verlet")
    prepared = PreparedRun(prepare(scene, is_led=True), scene, folder, {}, plotter=None)
    with device_run(prepared, DeviceOptions(listen="127.0.0.1:0", **options)) as led:
        yield WatchedRun(prepared, led)


@contextlib.contextmanager
def beside(act):
    """Do something in a thread, and raise afterwards what it raised."""
    errors = []

    def guarded():
        try:
            act()
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=guarded)
    thread.start()
    try:
        yield thread
    finally:
        thread.join()
    if errors:
        raise errors[0]


def lead_forwards(client: DeviceClient, least: float, origin: float = 0.0) -> None:
    """Lead forwards at the period of the device until the blade has moved by `least` [m].

    Args:
        client: The device's.
        least: How far the blade is to move.
        origin: Where the stylus is at first [m].
    """
    start = due = time.monotonic()
    before = client.measured().measured_cp.position
    while True:
        way = np.array([0.0, origin + SPEED * (time.monotonic() - start), 0.0])
        state = client.servo_cp(way, UNTURNED)
        if state.has_ended or state.measured_cp.position[1] - before[1] >= least:
            return
        due = max(due + PERIOD, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))


def refused(client: DeviceClient, position, orientation=UNTURNED) -> None:
    """Send a pose that is refused."""
    try:
        client.servo_cp(position, orientation)
    except LinkError as error:
        assert "refused" in str(error)
    else:
        raise AssertionError("it was taken")
