"""The process that answers a device, while the run beside it stands still, or has been killed."""

import contextlib
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from bridge import (
    DeviceClient,
    DeviceDescription,
    DeviceEnd,
    DeviceLimits,
    DeviceProcess,
    LinkError,
)
from tests.bridge.device.simulated_hand import LEVER, UNTURNED, report

END = DeviceEnd(DeviceDescription("organ", 10.0, 0.2, 2.0), DeviceLimits(), LEVER)

PATIENCE = 10.0
"""Longest wait for what must happen [s]."""

RUN = """
import time
from tests.bridge.device.test_device_process import END, report
from bridge import DeviceProcess
with DeviceProcess(END, report(time.monotonic(), -1.0), "127.0.0.1", 0, None) as answers:
    print(answers.address, answers._process.pid, flush=True)
    while True:
        answers.tell(report(time.monotonic(), -1.0))
        time.sleep(1e-3)
"""
"""A run whose blade feels 1 N, frame after frame."""


@contextlib.contextmanager
def process_of_a_run():
    """Yield a run in another process, the address of its device, and the process that answers."""
    run = subprocess.Popen([sys.executable, "-c", RUN], stdout=subprocess.PIPE, text=True)
    try:
        address, pid = run.stdout.readline().split()
        yield run, address, int(pid)
    finally:
        run.kill()
        run.wait()
        run.stdout.close()


def force_after(client, seconds, until):
    """Drive until the force is such, and return it."""
    end = time.monotonic() + seconds
    while True:
        force = client.servo_cp(np.zeros(3), UNTURNED).measured_cf.force[1]
        if until(force):
            return force
        assert time.monotonic() < end, force
        time.sleep(1e-3)


def is_alive(pid):
    with contextlib.suppress(OSError):
        os.kill(pid, 0)
        return True
    return False


def test_a_run_that_is_stopped_leaves_a_device_that_is_answered_and_feels_nothing():
    with process_of_a_run() as (run, address, _), DeviceClient(address) as client:
        assert force_after(client, PATIENCE, lambda force: force < -0.9) < -0.9
        run.send_signal(signal.SIGSTOP)
        assert force_after(client, PATIENCE, lambda force: force == 0.0) == 0.0
        run.send_signal(signal.SIGCONT)
        assert force_after(client, PATIENCE, lambda force: force < -0.9) < -0.9


def test_the_process_ends_with_a_run_that_is_killed():
    with process_of_a_run() as (run, address, pid):
        with DeviceClient(address) as client:
            run.send_signal(signal.SIGKILL)
            with pytest.raises(LinkError):
                force_after(client, PATIENCE, lambda force: False)
        until = time.monotonic() + PATIENCE
        while is_alive(pid) and time.monotonic() < until:
            time.sleep(1e-2)
        assert not is_alive(pid)


def test_a_run_notices_that_the_process_has_ended(answers):
    assert answers.command().hold == 0
    answers._process.kill()
    answers._process.wait()
    with pytest.raises(LinkError, match="answers the device has ended"):
        answers.command()


@pytest.fixture
def answers():
    with DeviceProcess(END, report(time.monotonic(), 0.0), "127.0.0.1", 0, None) as found:
        yield found


def test_what_a_device_wants_arrives_as_it_was_sent(answers):
    with DeviceClient(answers.address, period=2e-3) as client:
        client.servo_cp(np.array([0.1, 0.2, 0.3]), UNTURNED)
        client.servo_cp(np.array([0.1, 0.25, 0.3]), UNTURNED)
        command = answers.command()
        assert (command.hold, command.period, command.has_ended) == (1, 2e-3, False)
        assert command.first.position.tolist() == [0.1, 0.2, 0.3]
        assert command.stylus.position.tolist() == [0.1, 0.25, 0.3]
        with pytest.raises(LinkError, match="has jumped by"):
            client.servo_cp(np.array([0.1, 0.5, 0.3]), UNTURNED)
        assert answers.command().hold == 0
        client.servo_cp(np.array([0.1, 0.5, 0.3]), UNTURNED)
        client.end()
        assert answers.command().hold == 2 and answers.command().has_ended


@pytest.mark.parametrize(
    ("host", "port", "error", "message"),
    [
        ("0.0.0.0", 0, ValueError, "open to other machines"),
        ("127.0.0.1", 70000, ValueError, "port 70000 does not exist"),
        ("nowhere.invalid", 0, ValueError, "there is no host"),
    ],
)
def test_an_address_that_is_no_good_is_one_clear_error(host, port, error, message):
    with pytest.raises(error, match=message):
        DeviceProcess(END, report(0.0, 0.0), host, port, None)


def test_a_port_in_use_is_one_clear_error(answers):
    port = int(answers.address.rpartition(":")[2])
    with pytest.raises(LinkError, match="cannot listen at"):
        DeviceProcess(END, report(0.0, 0.0), "127.0.0.1", port, None)
