"""docs/wire.md agrees with the code, and docs/examples/client.py runs against a real server."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from bridge.device.messages import pack_state
from bridge.tcp.address import IDLE_SECONDS, N_PROBES, PROBE_SECONDS, parse_address
from bridge.tcp.channel import Authenticator, direction_keys
from bridge.tcp.messages.geoms import MAX_GEOMS
from bridge.tcp.messages.result import pack_result
from bridge.tcp.messages.text import MAX_VIEWS, WANTED_NAME
from bridge.tcp.peer import (
    FRAME_SECONDS,
    HANDSHAKE_BYTES,
    HANDSHAKE_SECONDS,
    SEND_SECONDS,
    SILENCE_SECONDS,
)
from bridge.tcp.request_limits import (
    FARTHEST_IN_A_REQUEST,
    LARGEST_SWEEP,
    MOST_STEPS_REQUESTED,
    MOST_WORK,
)
from bridge.tcp.single_client import MAX_STRANGERS
from bridge.tcp.wire import LARGEST_FRAME, MORE, PROTOCOL_VERSION, MessageKind
from tests.bridge.device.served_blade import STATE
from tests.bridge.tcp.serve_block import block_tissue
from tests.bridge.tcp.test_places import server_in_a_thread
from tests.processes import free_port, started_first
from tissue import Energies, RigidContacts
from tissue.contact.geoms.geom_contact import MOST_INCREMENTS

DOCS = Path(__file__).parents[3] / "docs"
WIRE = (DOCS / "wire.md").read_text(encoding="utf-8")
STEP, DEVICE = WIRE.split("## A device that leads")
CLIENT = DOCS / "examples" / "client.py"


def run_client(port):
    return subprocess.run(
        [sys.executable, "-I", str(CLIENT), str(port)], capture_output=True, text=True, timeout=60
    )


def test_a_client_of_forty_lines_cuts_the_tissue_and_prints_its_force(server):
    done = run_client(parse_address(server.address)[1])
    assert (done.returncode, done.stderr) == (0, "")
    rows = re.findall(r"(\d+) ms: ([+-][\d.]+) N along y, (\d+) mm2 cut", done.stdout)
    assert len(rows) == 10
    assert min(float(force) for _, force, _ in rows) == pytest.approx(-5.0 * 0.02, rel=0.3)
    assert float(rows[-1][2]) == pytest.approx(20 * 20, rel=0.05)


def test_the_client_is_forty_lines_and_imports_only_the_standard_library():
    lines = [line for line in CLIENT.read_text().splitlines() if line.strip()]
    assert len(lines) <= 40
    imported = re.findall(r"^(?:import|from) (\w+)", CLIENT.read_text(), re.MULTILINE)
    assert set(imported) <= set(sys.stdlib_module_names)


def test_the_client_waits_for_a_server_that_gets_ready_meanwhile():
    port = free_port()
    with started_first(CLIENT, port) as client, server_in_a_thread(port=port):
        assert client.stdout.readline().startswith("100 ms: ")


def test_the_client_prints_why_the_server_refuses_it(start_server):
    server = start_server(key=bytes(32))
    done = run_client(parse_address(server.address)[1])
    assert done.returncode == 1 and "this server requires a key" in done.stderr


def test_the_numbers_of_a_state_are_where_the_table_says():
    payload = pack_state(STATE._replace(n_missed=8, n_dropped=9))
    rows = re.findall(r"^\| (\d+) \| (f64|i64|u32) x (\d)", DEVICE, re.MULTILINE)
    types = {"f64": "<f8", "i64": "<i8", "u32": "<u4"}
    found = [np.frombuffer(payload, types[t], int(n), int(at)).tolist() for at, t, n in rows]
    assert found == [
        [STATE.time, STATE.real_time_factor],
        [*STATE.measured_cp.position, *STATE.measured_cp.orientation],
        [*STATE.measured_cf.force, *STATE.measured_cf.torque],
        [STATE.n_limited, 8, 9],
        [1, 0],
    ]
    assert len(payload) == int(rows[-1][0]) + 8


def test_every_kind_of_message_is_in_the_table():
    table = dict(re.findall(r"^\| (\d+) \| ([A-Z]+) \|", WIRE, re.MULTILINE))
    assert {int(kind): name for kind, name in table.items()} == {
        kind: kind.name for kind in MessageKind
    }


def test_the_limits_are_those_of_the_server():
    assert (
        f"Version {PROTOCOL_VERSION}." in WIRE
        and f"0x{MORE:x}" in WIRE
        and f"{LARGEST_FRAME:,}" in WIRE
    )
    assert f"until HELLO is done, {HANDSHAKE_BYTES} bytes" in WIRE
    assert f"complete after {FRAME_SECONDS:g} s, and a reply read after {SEND_SECONDS:g} s" in WIRE
    assert f"HELLO must be done {HANDSHAKE_SECONDS:g} s" in WIRE
    assert f"Beside the client's at most {MAX_STRANGERS} connections" in WIRE
    assert f"at least every {SILENCE_SECONDS:g} s" in WIRE
    gone = IDLE_SECONDS + N_PROBES * PROBE_SECONDS
    assert f"has not answered the system for {gone} s" in WIRE
    assert f"more than {FARTHEST_IN_A_REQUEST:g} times the mean node size" in WIRE
    assert f"more than {LARGEST_SWEEP:,.0f} squares of the mean node size" in WIRE
    assert f"more than {MOST_STEPS_REQUESTED:,} steps of the integrator" in WIRE
    assert f"more than {MOST_WORK / 1e6:g} million" in WIRE
    assert f"{WANTED_NAME}" in WIRE
    assert f"at most {MAX_GEOMS}." in WIRE and f"more than {MOST_INCREMENTS:,}, is refused" in WIRE
    assert f"a list of at most {MAX_VIEWS}\ncameras" in WIRE


def test_the_numbers_of_a_result_are_where_the_table_says():
    random, n = np.random.default_rng(0), 3
    shapes = ((n, 3), (n, 3), n, (n, 3), n)
    contacts = RigidContacts(*map(random.random, shapes), geom=np.arange(n) - 1)
    result = (
        block_tissue().step(None, 1e-3)._replace(contacts=contacts, energies=Energies(*range(14)))
    )
    payload = pack_result(result)

    def at(offset, count):
        return np.frombuffer(payload, "<f8", count, offset)

    rows = re.findall(
        r"^\| (\d+)(?: \+ (\d+)n)? \| f64 x (\d+)(n?) \| ([\w ]+)", STEP, re.MULTILINE
    )
    found = {
        name.strip(): at(int(offset) + int(each or 0) * n, int(count) * (n if per_contact else 1))
        for offset, each, count, per_contact, name in rows
    }
    expected = {
        "length of the edge in the tissue": (
            result.anchored_length,
            result.cut_area,
            result.finished_area,
            result.work_of_blade,
            result.work_of_cutting,
        ),
        "contacts of the body with itself": (
            result.body_contacts.penetration,
            result.body_contacts.force,
        ),
        "wall time of collision": result.stage_times,
        "wrench on the blade": np.concatenate(result.wrench),
        "wrench at the end of the step": np.concatenate(result.wrench_t1),
        "local stiffness": result.stiffness.ravel(),
        "force on the tissue": result.force_on_tissue,
        "lowest and highest corner of the body": result.bounds.ravel(),
        "force of the floor on the body": result.body_contacts.force_of_floor,
        "contacts of blade and geoms": np.concatenate([array.ravel() for array in contacts]),
        "energies where the server audits them": np.arange(14.0),
    }
    assert set(found) == set(expected)
    for name, numbers in expected.items():
        np.testing.assert_array_equal(found[name], numbers, err_msg=name)


def test_the_tags_of_the_documentation_are_those_of_the_link():
    (code,) = re.findall(r"```python\n(.*?)```", WIRE, re.DOTALL)
    namespace = {}
    exec(compile(code, "wire.md", "exec"), namespace)
    key, mine, theirs = bytes(range(32)), bytes(32), bytes([7] * 32)
    to_server, to_client = namespace["direction_keys"](key, mine, theirs)
    assert (to_server, to_client) == direction_keys(key, mine, theirs)
    authenticator = Authenticator(to_server)
    for n, payload in enumerate((b"", b"to cut")):
        kind, sequence = MessageKind.STEP | MORE, 10 + n
        tag = namespace["authentication_tag"](to_server, n, kind, sequence, payload)
        assert authenticator.with_tag(kind, sequence, payload) == payload + tag
