"""A fake device at 1 kHz leads a run over a real socket, and misbehaves."""

import time

import numpy as np
import pytest

from bridge import DeviceClient
from scalpel_sim.hands.commands import Pause, Reset, Resume
from scalpel_sim.hands.device_hand import MOST_HURRY
from scalpel_sim.hands.limited_pose import MOST_SPEED
from tests.scalpel_sim.hands.device_runs import (
    UNTURNED,
    beside,
    lead_forwards,
    refused,
    watched_run,
)
from tests.scalpel_sim.hands.driven_runs import DT, ROUNDING

SAFE_WITHIN = 0.05
"""Wall time in which a blade comes to rest that nobody leads any more [s]. What is bounded is when
the last frame began in which it was led, so that a machine that stands still fails no test."""

FARTHEST_IN_A_FRAME = MOST_HURRY * MOST_SPEED * DT + ROUNDING
"""Way of the blade in a frame, where the run is slow [m]."""

GOOD = 2e-3
"""How far the blade is led before the device misbehaves [m]."""


def fall_silent(client, peer):
    pass


def disconnect(client, peer):
    client.close()


def send_nan(client, peer):
    refused(client, np.full(3, np.nan))


def send_infinity(client, peer):
    refused(client, np.zeros(3), np.array([np.inf, 0.0, 0.0, 0.0]))


def jump(client, peer):
    refused(client, np.array([0.0, 10.0, 0.0]))


def send_garbage(client, peer):
    peer.sendall(bytes(range(256)))


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    with watched_run(tmp_path_factory.mktemp("run")) as found:
        yield found


@pytest.mark.parametrize(
    "misbehave", [fall_silent, disconnect, send_nan, send_infinity, jump, send_garbage]
)
def test_a_device_that_misbehaves_leaves_the_blade_at_rest_within_50_ms(run, misbehave):
    stopped_at = []

    def act():
        with DeviceClient(run.address) as client:
            lead_forwards(client, GOOD)
            stopped_at.append(time.monotonic())
            misbehave(client, client._connection._socket)
            time.sleep(2.0 * SAFE_WITHIN)  # the connection stays open, except where it was closed

    run.run_beside(act)
    assert any(frame.is_engaged for frame in run.frames)
    assert run.led_after(stopped_at[0]) <= SAFE_WITHIN
    last = max(k for k, frame in enumerate(run.frames) if frame.is_engaged)
    tips = np.array([frame.tip for frame in run.frames])
    assert np.ptp(tips[: last + 1, 1]) > 0.5 * GOOD, "it was led before"
    assert len(tips) - last > 20 and np.ptp(tips[last + 1 :], axis=0).max() == 0.0


def test_a_device_that_comes_again_leads_on_from_where_the_blade_is(run):
    def act():
        with DeviceClient(run.address) as client:
            lead_forwards(client, GOOD, origin=1.0)

    run.run_beside(act)
    steps = np.diff([frame.tip for frame in run.frames], axis=0)
    assert np.linalg.norm(steps, axis=1).max() <= FARTHEST_IN_A_FRAME
    assert any(frame.is_engaged for frame in run.frames)


def test_the_device_feels_the_force_and_learns_how_fast_the_run_is(tmp_path):
    states = []

    def act():
        with DeviceClient(run.address) as client:
            start = time.monotonic()
            while not states or not states[-1].has_ended:
                travelled = min(0.03 * (time.monotonic() - start), 0.06)
                states.append(client.servo_cp(np.array([0.0, travelled, 0.0]), UNTURNED))
                time.sleep(1e-3)

    with watched_run(tmp_path, watchdog=10.0) as run:
        with beside(act):
            run.run(2.0)
            run.led.hand.finish(run.simulation.time)
            run.led.hand.tell()
        limit = run.simulation.arm.limits.force
    forces = np.array([state.measured_cf.force for state in states])
    assert -limit <= forces[:, 1].min() < -0.3, "toughness times thickness"
    times = np.array([state.time for state in states])
    assert (np.diff(times) >= 0.0).all() and times[-1] == pytest.approx(2.0, abs=2e-3)
    assert 0.0 < states[-1].real_time_factor < 1.1
    measured = np.array([state.measured_cp.position for state in states])
    assert np.ptp(measured[:, 1]) > 0.01


def test_a_reset_takes_the_blade_back_and_the_device_leads_on_from_there(run):
    run.led.controls.history.begin()
    run.run(1e-3)
    at_first = run.led.hand.tip

    def act():
        with DeviceClient(run.address) as client:
            lead_forwards(client, GOOD)
            run.led.controls.commands.append(Reset())
            while client.servo_cp(np.array([0.0, 0.01, 0.0]), UNTURNED).measured_cp.position[1] > (
                at_first[1] + 0.5 * GOOD
            ):
                pass
            lead_forwards(client, GOOD)

    run.run_beside(act)
    tips = np.array([frame.tip for frame in run.frames])
    back = int(np.argmin(np.diff(tips[:, 1])))
    assert tips[back, 1] - tips[back + 1, 1] > 0.5 * GOOD
    assert tips[back + 1] == pytest.approx(at_first, abs=1e-6)
    steps = np.abs(np.diff(tips[back + 1 :], axis=0))
    assert steps.max() <= FARTHEST_IN_A_FRAME and tips[-1, 1] > tips[back + 1, 1] + 0.5 * GOOD


def test_a_run_that_is_paused_answers_and_leads_on_when_it_goes_on(run):
    run.run(1e-3)
    at_pause = []

    def act():
        with DeviceClient(run.address) as client:
            lead_forwards(client, GOOD)
            run.led.controls.commands.append(Pause())
            times = [client.measured().time for _ in range(50)]
            while times[-1] != times[-2]:
                times.append(client.measured().time)
            client.servo_cp(np.array([0.0, 0.05, 0.0]), UNTURNED)
            at_pause.append(client.measured())
            run.led.controls.commands.append(Resume())
            lead_forwards(client, GOOD)

    run.run_beside(act)
    paused_at = at_pause[0].measured_cp.position[1]
    ys = np.array([frame.tip[1] for frame in run.frames])
    assert np.abs(np.diff(ys)).max() <= FARTHEST_IN_A_FRAME
    assert ys[-1] - paused_at < 3.0 * GOOD, "what the stylus did meanwhile is lost"


def test_half_a_message_does_not_keep_the_blade_led(run):
    stopped_at = []

    def act():
        with DeviceClient(run.address) as client:
            lead_forwards(client, GOOD)
            stopped_at.append(time.monotonic())
            for byte in b"SCUT":
                client._connection._socket.sendall(bytes([byte]))
                time.sleep(0.5 * SAFE_WITHIN)

    run.run_beside(act)
    assert run.led_after(stopped_at[0]) <= SAFE_WITHIN
