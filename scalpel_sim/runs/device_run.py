"""A run whose blade a device leads."""

import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from bridge import (
    DEFAULT_DEVICE_PORT,
    DEFAULT_HOST,
    DeviceDescription,
    DeviceEnd,
    DeviceProcess,
    chosen_key,
    parse_address,
)
from scalpel_sim.errors import UsageError
from scalpel_sim.hands.commands import Command
from scalpel_sim.hands.device_hand import WATCHDOG, DeviceHand
from scalpel_sim.hands.limited_pose import MOST_SPEED, MOST_TURN_RATE
from scalpel_sim.hands.run_controls import History, Pace, RunControls
from scalpel_sim.output.summary import Summary
from scalpel_sim.runs.console import say, wait_until
from scalpel_sim.runs.options import DeviceOptions
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.run import perform
from scalpel_sim.scene.checks import LONGEST_RUN
from scalpel_sim.simulation import Simulation

SECONDS_PER_WAIT = 0.002
"""Time between two looks whether a device has taken hold [s]."""

LONGEST_WATCHDOG = 10.0
"""Longest time of the watchdog [s]: a blade that is led for longer by nobody is a mistake."""


class DeviceRun(NamedTuple):
    """A run that waits for a device."""

    hand: DeviceHand
    answers: DeviceProcess
    controls: RunControls
    """They have that hand."""


def check_device_options(device: DeviceOptions, *, is_led: bool) -> None:
    """Refuse options of a device where none leads, and what makes no sense.

    Raises:
        UsageError: an option is of no use, or out of range.
    """
    given = [name for name, value in vars(device).items() if value is not None]
    if given and not is_led:
        raise UsageError(
            f"--{given[0].replace('_', '-')} is for a device that leads; add --hand device, or "
            "omit it"
        )
    if device.watchdog is not None and not 0.0 < device.watchdog <= LONGEST_WATCHDOG:
        raise UsageError(
            f"--watchdog {device.watchdog:g} is out of range; wanted more than 0 s, and at most "
            f"{LONGEST_WATCHDOG:g} s"
        )


@contextmanager
def device_run(
    prepared: PreparedRun, device: DeviceOptions, commands: deque[Command] | None = None
) -> Iterator[DeviceRun]:
    """Yield the hand of a run, and the process at which a device can take hold of it.

    Args:
        prepared: The run.
        device: Options of the device.
        commands: Commands of a page; None: there is no page.

    Raises:
        ValueError: the address is malformed, or open to other machines and there is no key.
        LinkError: the port is in use or not allowed.
    """
    simulation, scene = prepared.simulation, prepared.scene
    watchdog = WATCHDOG if device.watchdog is None else device.watchdog
    pace = Pace(shortest_pause=0.0)
    hand = DeviceHand(
        simulation,
        lambda: pace.factor,
        seconds=LONGEST_RUN if scene.seconds is None else scene.seconds,
        watchdog=watchdog,
        ends_with_client=device.client_stops == "end",
    )
    listen = device.listen or f"{DEFAULT_HOST}:{DEFAULT_DEVICE_PORT}"
    host, port = parse_address(listen)
    end = DeviceEnd(
        DeviceDescription(scene.name, watchdog, MOST_SPEED, MOST_TURN_RATE),
        simulation.arm.limits,
        hand.blade.half,
    )
    key = chosen_key(device.listen_key)

    def stand_still(seconds: float) -> None:
        hand.tell()  # a run that stands still is not silent
        time.sleep(seconds)

    controls = RunControls(pace, History(simulation), hand, commands, sleep=stand_still)
    with DeviceProcess(end, hand.report(), host, port, key) as answers:
        hand.answers = answers
        yield DeviceRun(hand, answers, controls)


def perform_device(
    prepared: PreparedRun, led: DeviceRun, is_running: Callable[[], bool] = lambda: True
) -> Summary:
    """Do the run from when a device takes hold of the blade until the stroke is ended.

    Args:
        prepared: The run.
        led: Its hand, and what answers the device.
        is_running: Whether what shows it is still there.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: nothing shows it any more before a device came; or the run failed.
    """
    hand, answers, controls = led

    def look() -> None:
        hand.listen()
        time.sleep(SECONDS_PER_WAIT)

    def wait_for_a_device() -> None:
        wait_until(
            f"waiting for a device at {answers.address}",
            lambda: hand.has_begun,
            "a device took hold of the blade",
            look,
            is_running,
        )

    def tell_and_wait(now: Simulation) -> None:
        hand.tell()
        controls.pace.wait(now.dt)

    summary = perform(
        prepared, every_frame=tell_and_wait, controls=controls, before_frames=wait_for_a_device
    )
    counted = answers.command()
    say(
        f"periods missed: {counted.n_missed}, frames limited: {hand.n_limited}, "
        f"messages dropped: {counted.n_dropped}"
    )
    return summary
