"""A SpaceMouse leads the blade: by reports that were recorded."""

import math
import struct
import sys
from types import SimpleNamespace

import numpy as np
import pytest

from bridge import DeviceClient
from scalpel_sim.cli.app import command_line
from scalpel_sim.hands.spacemouse import (
    DEAD_ZONE,
    FULL_SPEED,
    FULL_TURN_RATE,
    SPACEMOUSE_PERIOD,
    SpaceMouseStylus,
    lead_by_spacemouse,
)
from tests.scalpel_sim.hands.device_runs import beside, watched_run
from tests.scalpel_sim.hands.spacemouse_reports import FULL, REPORTS, PlayedSpaceMouse, take_report

AXES = ("x", "y", "z", "roll", "pitch", "yaw")


def reading(**deflections):
    return SimpleNamespace(**dict.fromkeys(AXES, 0.0) | deflections, buttons=[])


@pytest.mark.parametrize("axis", range(3))
def test_full_deflection_is_full_speed_along_an_axis_of_the_world(axis):
    stylus = SpaceMouseStylus()
    for _ in range(100):
        stylus.move(reading(**{AXES[axis]: -1.0}), 0.01)
    assert stylus.position == pytest.approx(-FULL_SPEED * np.eye(3)[axis])


@pytest.mark.parametrize("axis", range(3))
def test_a_twist_is_a_turn_about_an_axis_of_the_world(axis):
    stylus = SpaceMouseStylus()
    for _ in range(100):
        stylus.move(reading(**{AXES[3 + axis]: 1.0}), 0.01)
    angle = 0.5 * FULL_TURN_RATE
    wanted = [math.cos(angle), *(math.sin(angle) * np.eye(3)[axis])]
    assert stylus.orientation == pytest.approx(wanted)


def test_a_cap_at_rest_moves_nothing():
    stylus = SpaceMouseStylus()
    stylus.move(reading(**dict.fromkeys(AXES, DEAD_ZONE)), 1.0)
    assert stylus.position.tolist() == [0.0, 0.0, 0.0]
    assert stylus.orientation.tolist() == [1.0, 0.0, 0.0, 0.0]


def test_reports_of_a_spacemouse_lead_the_blade_let_go_and_end(tmp_path):
    ends, mouse = [], PlayedSpaceMouse()

    def act():
        with DeviceClient(run.address, period=SPACEMOUSE_PERIOD) as client:
            ends.append(lead_by_spacemouse(client, mouse.read, mouse.clock, mouse.sleep))

    with watched_run(tmp_path, watchdog=10.0) as run:
        run.run(0.01)  # where kernels have to be compiled, no client waits for it
        run.frames.clear()
        with beside(act) as mouse_thread:
            while mouse_thread.is_alive() and run.led.hand.ended_at is None:
                run.run(0.05)
            run.led.hand.tell()
    tips = np.array([frame.tip for frame in run.frames])
    engaged = np.array([frame.is_engaged for frame in run.frames])
    assert tips[-1] - tips[0] == pytest.approx([0.0, pushed_away(), 0.0], abs=2e-4)
    assert ends[0].has_ended
    released = np.flatnonzero(np.diff(engaged.astype(int)) == -1)
    assert len(released) == 2, "by the left button, while it was pushed to the right; at the end"


def pushed_away():
    """Return how far the recorded reports move the stylus away [m]: a sum over their times."""
    motions = [(at, -struct.unpack("<3h", r[1:7])[1] / FULL) for at, r in REPORTS if r[0] == 1]
    times, away = np.array(motions).T
    speeds = FULL_SPEED * np.clip(away - DEAD_ZONE, 0.0, None) / (1.0 - DEAD_ZONE)
    return float(np.sum(speeds[:-1] * np.diff(times)))


def test_the_reports_are_read_here_as_pyspacemouse_reads_them():
    pyspacemouse = pytest.importorskip("pyspacemouse")
    spec = pyspacemouse.apply_axis_convention(
        pyspacemouse.get_device_specs()["SpaceMouseCompact"], pyspacemouse.AxisConvention.HID_Z_UP
    )
    reports = iter([report for _, report in REPORTS])
    mouse = pyspacemouse.SpaceMouseDevice(spec, SimpleNamespace(read=lambda size: next(reports)))
    ours = PlayedSpaceMouse().reading
    for _, report in REPORTS:
        theirs = mouse.read()
        take_report(ours, report)
        assert [getattr(ours, axis) for axis in AXES] == [getattr(theirs, axis) for axis in AXES]
        assert list(theirs.buttons) == list(ours.buttons)


def test_without_pyspacemouse_the_command_says_what_to_install(monkeypatch, capsys):
    monkeypatch.setitem(sys.modules, "pyspacemouse", None)
    assert command_line(["spacemouse"]) == 1
    assert "pip install scalpel-sim[spacemouse]" in capsys.readouterr().err
