"""A run whose blade a device leads, with a page that shows it or without."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import NamedTuple

from bridge import (
    DEFAULT_DEVICE_PORT,
    DEFAULT_HOST,
    DeviceDescription,
    DeviceServer,
    chosen_key,
    parse_address,
)
from scalpel_sim.errors import Interrupted, RunError, UsageError
from scalpel_sim.hands.device_hand import WATCHDOG, DeviceHand
from scalpel_sim.hands.limited_pose import MOST_SPEED, MOST_TURN_RATE
from scalpel_sim.hands.run_controls import History, Pace, RunControls
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.summary import Summary
from scalpel_sim.runs.console import print_report, say, stay_while
from scalpel_sim.runs.options import DeviceOptions, PageOptions
from scalpel_sim.runs.prepared_run import PreparedRun, perform_by_hand
from scalpel_sim.runs.stop_signals import StopSignals
from scalpel_sim.scene.checks import LONGEST_RUN
from scalpel_sim.viewer.messages import PageControls
from scalpel_sim.viewer.pictures import show_run
from scalpel_sim.viewer.viewer import Viewer

SECONDS_PER_WAIT = 0.02
"""How often it is looked whether a waiting run is to end [s]."""

LONGEST_WATCHDOG = 10.0
"""Longest time of the watchdog [s]: a blade that is led for longer by nobody is a mistake."""


class DeviceRun(NamedTuple):
    """A run that waits for a device."""

    hand: DeviceHand
    server: DeviceServer
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
def device_run(prepared: PreparedRun, device: DeviceOptions) -> Iterator[DeviceRun]:
    """Yield the hand of a run, and the server at which a device can take hold of it.

    Raises:
        ValueError: the address is malformed, or open to other machines and there is no key.
        LinkError: the port is in use or not allowed.
    """
    simulation, scene = prepared.simulation, prepared.scene
    watchdog = WATCHDOG if device.watchdog is None else device.watchdog
    # What waits and what listens is called later, when there is a server.
    pace = Pace(sleep=lambda seconds: server.serve_for(seconds), shortest_pause=0.0)
    hand = DeviceHand(
        simulation,
        lambda: pace.factor,
        lambda: server.serve_for(0.0),
        seconds=LONGEST_RUN if scene.seconds is None else scene.seconds,
        watchdog=watchdog,
        ends_with_client=device.client_stops == "end",
    )
    listen = device.listen or f"{DEFAULT_HOST}:{DEFAULT_DEVICE_PORT}"
    host, port = parse_address(listen)
    server = DeviceServer(
        hand,
        DeviceDescription(scene.name, watchdog, MOST_SPEED, MOST_TURN_RATE),
        host=host,
        port=port,
        key=chosen_key(device.listen_key),
    )
    # A run that stands still serves, too.
    controls = RunControls(pace, History(simulation), hand, sleep=server.serve_for)
    with server:
        yield DeviceRun(hand, server, controls)


def perform_device(
    prepared: PreparedRun,
    plotter: Plotter,
    led: DeviceRun,
    check: Callable[[], None] = lambda: None,
) -> Summary:
    """Do the run from when a device takes hold of the blade until the stroke is ended.

    Args:
        prepared: The run.
        plotter: Draws the plots.
        led: Its hand and its server.
        check: Called while it waits; raises an error to end that.

    Raises:
        Interrupted: the user or the system ended the run.
        RunError: the run failed.
    """
    hand, server, controls = led
    with StopSignals() as stop:
        say(f"waiting for a device at {server.address}")
        while not hand.has_begun:
            if stop.reason is not None:
                raise Interrupted(f"{stop.reason} before a device took hold of the blade")
            check()
            server.serve_for(SECONDS_PER_WAIT)
    summary = perform_by_hand(prepared, plotter, controls)
    counted = server.state()
    say(
        f"periods missed: {counted.n_missed}, frames limited: {counted.n_limited}, "
        f"messages dropped: {counted.n_dropped}"
    )
    return summary


def view_device(
    prepared: PreparedRun, page: PageOptions, device: DeviceOptions, plotter: Plotter
) -> None:
    """Do the run, and show it in the page, which may pause it, slow it down or end it.

    Args:
        prepared: The run.
        page: Options of the page.
        device: Options of the device.
        plotter: Draws the plots.

    Raises:
        RunError: the viewer has ended before a device came; or as in `perform_device`.
    """
    simulation = prepared.simulation
    with (
        device_run(prepared, device) as led,
        Viewer(
            simulation.arm.model,
            title=simulation.title,
            frame=simulation.frame,
            wireframe=page.wireframe,
            port=page.port,
            views=prepared.scene.views,
            controls=PageControls(led.controls.commands),
        ) as viewer,
    ):

        def check() -> None:
            if not viewer.is_running:
                raise RunError("the viewer has ended before a device took hold of the blade")

        show = show_run(viewer, simulation, led.controls)
        say(f"live at {viewer.url}")
        summary = perform_device(prepared, plotter, led, check)
        show()
        print_report(summary, prepared.folder, prepared.exports, prepared.printing)
        stay_while(
            lambda: viewer.is_running,
            f"{viewer.url} stays until Ctrl-C",
            led.controls.on_wait,
        )
