"""A device's client and the server in a run, over real sockets."""

import re
import socket
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from bridge import DeviceClient, LinkError, TcpLink, parse_address
from bridge.device.messages import SERVO, ServoRequest
from bridge.tcp.wire import MessageKind, pack_frame
from tests.bridge.device.served_blade import ORIGIN, POSE, STATE, UNTURNED, served_blade
from tests.bridge.tcp.bare_sockets import HELLO, connected, read_one
from tests.support.processes import free_port, started_first

EXAMPLE = Path(__file__).parents[3] / "docs" / "examples" / "device.py"
KEY = bytes(range(32))
PATIENCE = 10.0
"""Longest wait for what must happen [s]."""


@pytest.fixture
def served():
    with served_blade() as found:
        yield found


def wait_for(blade, what):
    """Wait until that is the last thing that was asked of a blade."""
    until = time.monotonic() + PATIENCE
    while blade.asked[-1:] != [(what,)]:
        assert time.monotonic() < until, blade.asked[-3:]
        time.sleep(1e-3)


def servo_frame(number, stamp, position=ORIGIN):
    request = ServoRequest(stamp, 1e-3, POSE._replace(position=np.array(position)), True)
    return pack_frame(MessageKind.SERVO, number, SERVO.pack(request))


def bare_device(address):
    """Return a bare socket that the server takes for a device."""
    peer = connected(address)
    peer.sendall(HELLO)
    assert read_one(peer).kind == MessageKind.HELLO
    return peer


def test_a_pose_goes_to_the_blade_and_its_state_comes_back(served):
    blade, address = served
    with DeviceClient(address) as client:
        assert client.description.scene == "organ"
        state = client.servo_cp(np.array([0.1, 0.2, 0.3]), UNTURNED)
    assert blade.asked[0] == ("servo_cp", 0.1, 0.2, 0.3, True)
    assert (state.time, state.real_time_factor, state.n_limited) == (1.25, 0.5, 7)
    assert np.array_equal(state.measured_cf.torque, STATE.measured_cf.torque)


def test_to_ask_where_the_blade_is_asks_nothing_of_it(served):
    blade, address = served
    with DeviceClient(address) as client:
        position, _ = client.measured().measured_cp
    assert position.tolist() == [0.1, 0.2, 0.3]
    wait_for(blade, "lose_client")
    assert len(blade.asked) == 1


def test_a_device_ends_the_run(served):
    blade, address = served
    with DeviceClient(address) as client:
        client.end()
        assert blade.asked == [("end",)]


@pytest.mark.parametrize("wrong", [np.nan, np.inf, 1e4, 10.0], ids=str)
def test_a_refused_pose_lets_go_and_the_link_stays_open(served, wrong):
    blade, address = served
    with DeviceClient(address) as client:
        with pytest.raises(LinkError, match="refused"):
            client.servo_cp(np.array([wrong, 0.0, 0.0]), UNTURNED)
        assert blade.asked[-1] == ("release",)
        assert client.servo_cp(ORIGIN, UNTURNED).n_dropped == 1
        assert blade.asked[-1][0] == "servo_cp"


@pytest.mark.parametrize(
    "garbage",
    [b"GET / HTTP/1.1\r\n\r\n", bytes(64), pack_frame(99, 1)[:-1] + b"x"],
    ids=["http", "zeros", "wrong checksum"],
)
def test_a_stream_that_cannot_be_read_lets_go_and_another_device_may_come(served, garbage):
    blade, address = served
    with bare_device(address) as peer:
        peer.sendall(servo_frame(1, 0.0))
        read_one(peer)
        peer.sendall(garbage)
        wait_for(blade, "lose_client")
    assert blade.asked[-1] == ("lose_client",)
    with DeviceClient(address) as client:
        client.servo_cp(ORIGIN, UNTURNED)
        assert blade.asked[-1][0] == "servo_cp"


@pytest.mark.parametrize("key", [None, bytes(32)], ids=["no key", "wrong key"])
def test_a_device_without_the_key_leads_nothing(key):
    with served_blade(KEY) as (blade, address):
        with pytest.raises(LinkError, match="key"):
            DeviceClient(address, key=key)
        assert blade.asked == []
        with DeviceClient(address, key=KEY) as client:
            client.servo_cp(ORIGIN, UNTURNED)


def test_periods_without_a_pose_are_counted_by_the_stamps(served):
    _, address = served
    with bare_device(address) as peer:
        for number, milliseconds in enumerate([0.0, 1.0, 2.2, 3.0, 7.0, 7.9], start=1):
            peer.sendall(servo_frame(number, 50.0 + 1e-3 * milliseconds))
            read_one(peer)
    with device_once_free(address) as client:
        assert client.measured().n_missed == 3


def test_no_stamps_of_a_device_make_the_next_ones_replies_too_large(served):
    _, address = served
    with bare_device(address) as peer:
        for number, stamp in enumerate([-1e308, 1e308, -1e308, 1e308, 0.0, 1e300], start=1):
            peer.sendall(servo_frame(number, stamp))
            assert read_one(peer).kind == MessageKind.SERVO
    with device_once_free(address) as client:
        assert client.measured().n_missed == 3 * (3_600_000 - 1)


def device_once_free(address):
    """Return a client, as soon as the server has noticed that the last one has left."""
    until = time.monotonic() + PATIENCE
    while True:
        try:
            return DeviceClient(address)
        except LinkError:
            assert time.monotonic() < until
            time.sleep(1e-2)


def test_a_device_that_reads_no_replies_is_dropped_and_delays_no_frame(served):
    blade, address = served
    peer = bare_device(address)
    peer.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    frames = b"".join(servo_frame(number, 1e-3 * number) for number in range(1, 60_000))
    with pytest.raises(OSError):
        peer.settimeout(PATIENCE)
        peer.sendall(frames)
        while True:
            peer.sendall(pack_frame(MessageKind.MEASURED, 60_000))
    wait_for(blade, "lose_client")
    peer.close()


def test_a_tissue_is_not_taken_for_a_run_nor_a_run_for_a_tissue(served, server):
    with pytest.raises(LinkError, match="no run that a device drives"):
        DeviceClient(server.address)
    with pytest.raises(LinkError, match="description cannot be read"):
        TcpLink(served[1])


def test_a_client_of_fifty_lines_drives_the_blade_and_prints_its_force(served):
    blade, address = served
    done = run_example(address)
    assert (done.returncode, done.stderr) == (0, "")
    rows = re.findall(r"([\d.]+) s: tip at y ([+-][\d.]+) mm, ([+-][\d.]+) N", done.stdout)
    assert len(rows) == 10 and rows[0] == ("1.250", "+200.0", "+2.000")
    assert re.search(r"frames limited 7, periods missed \d+, messages dropped 0", done.stdout)
    ys = [asked[2] for asked in blade.asked if asked[0] == "servo_cp"]
    assert len(ys) == 3000 and ys[0] == pytest.approx(0.2, abs=1e-3)
    assert ys[-1] == pytest.approx(0.2 + 0.06, abs=1e-3), "3 s at 20 mm/s from where the blade was"


def test_the_client_is_fifty_lines_and_imports_only_msgpack_besides_the_standard_library():
    text = EXAMPLE.read_text()
    assert len([line for line in text.splitlines() if line.strip()]) <= 50
    imported = re.findall(r"^(?:import|from) (\w+)", text, re.MULTILINE)
    assert set(imported) <= {"msgpack", *sys.stdlib_module_names}


def test_the_client_waits_for_a_run_that_gets_ready_meanwhile():
    port = free_port()
    with started_first(EXAMPLE, port) as client, served_blade(port=port):
        assert "organ" in client.stdout.readline()


def test_a_device_whose_patience_ends_says_that_there_is_no_run(monkeypatch):
    monkeypatch.setattr("bridge.tcp.connection.RETRY_SECONDS", 1e-3)
    with pytest.raises(LinkError, match="no run waits for a device at"):
        DeviceClient(f"127.0.0.1:{free_port()}", patience=0.02)


def test_the_client_prints_why_the_run_refuses_it():
    with served_blade(KEY) as (_, address):
        done = run_example(address)
    assert done.returncode == 1 and "this server requires a key" in done.stderr


def run_example(address):
    port = str(parse_address(address)[1])
    command = [sys.executable, "-I", str(EXAMPLE), port]
    return subprocess.run(command, capture_output=True, text=True, timeout=60)


def test_a_missing_run_is_one_clear_error():
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port = listener.getsockname()[1]
    with pytest.raises(LinkError, match=f"no run waits for a device at 127.0.0.1:{port}; start"):
        DeviceClient(f"127.0.0.1:{port}")
