"""docs/wire.md agrees with the code, and docs/examples/client.py runs against a real server."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from bridge.device.messages import DEVICE_DESCRIPTION, SERVO
from bridge.device.messages import STATE as DEVICE_STATE
from bridge.driven import GeomLoads
from bridge.tcp.address import IDLE_SECONDS, N_PROBES, PROBE_SECONDS, parse_address
from bridge.tcp.channel import Authenticator, direction_keys
from bridge.tcp.messages.body import (
    CHUNKS,
    CUT_FACES,
    CUT_REPORT,
    DEFORMATION,
    MATERIAL_POINTS,
    POINTS_NOW,
    SNAPSHOT,
    SURFACE,
)
from bridge.tcp.messages.driven import ATTACHMENT, GEOMS, MAX_GEOMS, TIE
from bridge.tcp.messages.encoding import Array
from bridge.tcp.messages.step import RESULT, STEP
from bridge.tcp.messages.text import DESCRIPTION, MAX_VIEWS, WANTED_NAME
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
from tests.bridge.tcp.test_places import server_in_a_thread
from tests.support.processes import free_port, started_first
from tissue import BodyContacts, MeshMeasures, RigidContacts, StageTimes
from tissue.contact.geoms.geom_contact import MOST_INCREMENTS

DOCS = Path(__file__).parents[3] / "docs"
WIRE = (DOCS / "wire.md").read_text(encoding="utf-8")
CLIENT = DOCS / "examples" / "client.py"


def run_client(port):
    return subprocess.run(
        [sys.executable, "-I", str(CLIENT), str(port)], capture_output=True, text=True, timeout=60
    )


def test_a_client_of_some_forty_lines_cuts_the_tissue_and_prints_its_force(server):
    done = run_client(parse_address(server.address)[1])
    assert (done.returncode, done.stderr) == (0, "")
    rows = re.findall(r"(\d+) ms: ([+-][\d.]+) N along y, (\d+) mm2 cut", done.stdout)
    assert len(rows) == 10
    assert min(float(force) for _, force, _ in rows) == pytest.approx(-5.0 * 0.02, rel=0.3)
    assert float(rows[-1][2]) == pytest.approx(20 * 20, rel=0.05)


def test_the_client_is_short_and_imports_only_msgpack_besides_the_standard_library():
    lines = [line for line in CLIENT.read_text().splitlines() if line.strip()]
    assert len(lines) <= 42
    imported = re.findall(r"^(?:import|from) (\w+)", CLIENT.read_text(), re.MULTILINE)
    assert set(imported) <= {"msgpack", *sys.stdlib_module_names}


def test_the_client_waits_for_a_server_that_gets_ready_meanwhile():
    port = free_port()
    with started_first(CLIENT, port) as client, server_in_a_thread(port=port):
        assert client.stdout.readline().startswith("100 ms: ")


def test_the_client_prints_why_the_server_refuses_it(start_server):
    server = start_server(key=bytes(32))
    done = run_client(parse_address(server.address)[1])
    assert done.returncode == 1 and "this server requires a key" in done.stderr


def test_every_kind_of_message_is_in_the_table():
    table = dict(re.findall(r"^\| (\d+) \| ([A-Z_]+) \|", WIRE, re.MULTILINE))
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
    assert f"Besides the client's at most {MAX_STRANGERS} connections" in WIRE
    assert f"at least every {SILENCE_SECONDS:g} s" in WIRE
    gone = IDLE_SECONDS + N_PROBES * PROBE_SECONDS
    assert f"has not answered the system for {gone} s" in WIRE
    assert f"more than {FARTHEST_IN_A_REQUEST:g} times the mean node size" in WIRE
    assert f"more than {LARGEST_SWEEP:,.0f} squares of the mean node size" in WIRE
    assert f"more than {MOST_STEPS_REQUESTED:,} steps of the integrator" in WIRE
    assert f"more than {MOST_WORK / 1e6:g} million" in WIRE
    assert f"{WANTED_NAME}" in WIRE
    assert f"at most {MAX_GEOMS}." in WIRE and f"more than {MOST_INCREMENTS:,}, is refused" in WIRE
    assert f"at most {MAX_VIEWS} cameras" in WIRE


TYPES = {"float64": "f64", "int64": "i64", "bool": "u8"}


def documented(heading):
    """Return names and types of fields in each table under a heading, in order."""
    section = re.split(r"^## ", WIRE.split(f"\n## {heading}\n")[1], flags=re.MULTILINE)[0]
    tables = section.split("| field | type | what |")[1:]
    return [dict(re.findall(r"^\| (\w+) \| ([^|]+?) \|", each, re.MULTILINE)) for each in tables]


def described(message):
    """Return names and types of the fields of a message, or of a part of one."""
    parts = getattr(message, "_part", message)._parts
    return {name: array_type(part) for name, part in parts.items()}


def array_type(part):
    if not isinstance(part, Array):
        return None
    lengths = " x ".join(map(str, (part._first, *part._rest)))
    return f"{TYPES[part._scalar.name]} {lengths}"


RESULT_PART = RESULT._part._parts["result"]


@pytest.mark.parametrize(
    ("heading", "messages"),
    [
        ("HELLO", [DESCRIPTION]),
        ("STEP", [STEP, RESULT, RESULT_PART]),
        (
            "The body",
            [
                SNAPSHOT,
                SURFACE,
                DEFORMATION,
                CUT_FACES,
                MATERIAL_POINTS,
                POINTS_NOW,
                CHUNKS,
                CUT_REPORT,
            ],
        ),
        ("Driven frames", [ATTACHMENT, TIE]),
        ("Driven geoms", [GEOMS]),
        ("A device that drives", [DEVICE_DESCRIPTION, SERVO, DEVICE_STATE]),
    ],
)
def test_the_fields_of_each_message_are_in_its_table(heading, messages):
    tables = documented(heading)
    assert len(tables) == len(messages)
    for table, message in zip(tables, messages, strict=True):
        fields = described(message)
        assert list(table) == list(fields)
        for name, array in fields.items():
            if array is not None:
                assert table[name].removesuffix(", optional") == array, name


@pytest.mark.parametrize("part", [RigidContacts, BodyContacts, StageTimes, GeomLoads, MeshMeasures])
def test_the_fields_of_each_part_are_named(part):
    assert [name for name in part._fields if f"`{name}`" not in WIRE] == []


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
