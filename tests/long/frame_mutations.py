"""Conversations of damaged frames with real servers, and what honest clients get beside them.

Every byte goes through a TCP socket of this machine. Servers and clients take turns in one thread:
a client sends, then the server serves what has come.
"""

import copy
import logging
import socket
import struct
import time
from functools import cache, partial
from typing import Any

import msgspec
import numpy as np

from bridge import DeviceDescription, DeviceServer
from bridge.device.messages import SERVO, CartesianPose, ServoRequest
from bridge.device.messages import STATE as DEVICE_STATE
from bridge.driven import FrameAttachment, FramePose, FrameTie, GeomPoses
from bridge.link import InProcessLink
from bridge.tcp.address import parse_address
from bridge.tcp.channel import Channel, direction_keys, new_nonce
from bridge.tcp.messages.driven import ATTACHMENT, TIE, pack_geoms
from bridge.tcp.messages.step import pack_step, unpack_result
from bridge.tcp.messages.text import unpack_error
from bridge.tcp.server import TissueServer
from bridge.tcp.single_client import SingleClientServer
from bridge.tcp.wire import LARGEST_FRAME, MORE, MessageKind, pack_frame
from tests.bridge.bits import bits
from tests.bridge.device.served_blade import STATE
from tests.bridge.tcp.serve_block import block_tissue
from tests.long.child import HANG
from tissue import BladeSegment, BladeSweep, Geom

KEY = bytes(range(32))
DT = 1e-3

N_FRAMES = 50
"""Damaged frames of a case."""

N_HONEST_STEPS = 300
"""Steps of the honest client's cut, after which it begins again."""

RAW = (
    *(struct.pack("<d", x) for x in (np.nan, np.inf, -np.inf, -1.0, 0.0, -0.0, 1.0, 999.9, 4e9)),
    *(struct.pack("<d", x) for x in (1e300, 1e-300, 5e-324, 1e-9, 0.5, 1.4, 1000.0, 1001.0)),
    *(struct.pack("<q", x) for x in (-1, 0, 1, 4_000_000_000, 2**63 - 1, -(2**63))),
)
"""What a number of a payload is replaced by."""

VALUES = (
    *(np.nan, np.inf, -np.inf, -1, 0, 1, 1e308, 1e-300, 4e9, 0.001, 4_000_000_000, 2**64 - 1),
    *(None, True, "", "top", "none", [], {}, [0], [[[]]], {"a": {}}, b"", bytes(8), bytes(24)),
)
"""What a field of a message is replaced by."""


def converse(case: int) -> list[bool]:
    """Let one of four hostile sides talk for `N_FRAMES` frames, and check what others get.

    Return of each message of the honest side whether its answer was that without the hostile one.
    """
    logging.getLogger("bridge").setLevel(logging.CRITICAL)  # refusals are what is asked for here
    random = np.random.default_rng(case)
    beside = [partial(_beside_a_client, kind) for kind in ("open", "key")]
    talks = (*beside, _as_client, _as_device)
    return talks[(0, 1, 0, 2, 3, 0, 1, 2, 3, 0)[case % 10]](random)


# ---- the honest side -----------------------------------------------------------------------------


class Talker:
    """One end of a connection to a server in this thread."""

    def __init__(self, server: SingleClientServer, key: bytes | None = None) -> None:
        self.server, self.channel, self.sequence = server, Channel(), 0
        self.socket = socket.create_connection(parse_address(server.address), 5.0)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        self.socket.setblocking(False)
        self.is_open = True
        if key is not None:
            nonce = new_nonce()
            (challenge,) = self.ask(MessageKind.HELLO, nonce)
            keys = direction_keys(key, nonce, challenge.payload)
            self.channel.authenticate(keys.to_server, keys.to_client)

    def send(self, data: bytes) -> None:
        """Send bytes, and let the server serve until nothing is left of them."""
        rest, begun = memoryview(data), time.process_time()
        while len(rest):
            try:
                rest = rest[self.socket.send(rest) :]
            except BlockingIOError:
                pass
            except OSError:
                self.is_open = False
                return
            serve(self.server)
        seconds = time.process_time() - begun
        assert seconds < HANG, f"{data[:200]!r} takes {seconds:.1f} s"

    def ask(self, kind: int, payload: bytes = b"") -> list:
        """Send a request, and return the frames that have come since."""
        self.send(b"".join(self.channel.pack(kind, self.sequence, payload)))
        self.sequence += 1
        return self.frames()

    def frames(self) -> list:
        """Return the frames that have come."""
        try:
            while data := self.socket.recv(1 << 16):
                self.channel.feed(data)
            self.is_open = False
        except BlockingIOError:
            pass
        except OSError:
            self.is_open = False
        found = []
        while (frame := self.channel.take()) is not None:
            found.append(frame)
        return found

    def close(self) -> None:
        self.socket.close()
        serve(self.server)


def serve(server: SingleClientServer) -> None:
    """Let a server do all that is due now."""
    while server._selector.select(0.0):
        server._serve_once(0.0)


@cache
def server_of(kind: str) -> SingleClientServer:
    """Return the server of that kind, which serves all cases of this process."""
    if kind == "device":
        return DeviceServer(CheckedBlade(), DeviceDescription("organ", 0.04, 0.2, 2.0), port=0)
    return TissueServer(block_tissue, scene="block", port=0, key=KEY if kind == "key" else None)


@cache
def reference() -> tuple[list[bytes], list[object]]:
    """Return the requests of an honest cut, and its results as bits."""
    link, requests, results = InProcessLink(block_tissue()), [], []
    for i in range(N_HONEST_STEPS):
        sweep = _sweep(i)
        requests.append(pack_step(sweep, DT))
        results.append(_outcome(link.step(sweep, DT)))
    return requests, results


def _sweep(i: int) -> BladeSweep:
    """Return the motion of the blade in a step of the honest cut."""
    ends, along = np.array([[0.009, -0.002, z] for z in (-0.005, 0.025)]), np.array([0.0, 1.0, 0.0])
    places = (ends + 0.05 * DT * n * along for n in (i, i + 1))
    return BladeSweep(*(BladeSegment(*place, along) for place in places))


def _outcome(result: object) -> object:
    return bits(result._replace(stage_times=None))


class HonestClient:
    """A client that cuts, a step in each case, and compares every result with the reference."""

    def __init__(self, kind: str) -> None:
        self._kind, self._n = kind, 0
        self._talker: Talker | None = None

    def step(self) -> bool:
        """Do the next step; return whether its result is that of the reference."""
        requests, results = reference()
        if self._n == len(requests):
            self.close()
        if self._talker is None:
            self._n = 0
            self._talker = Talker(server_of(self._kind), KEY if self._kind == "key" else None)
            (hello,) = self._talker.ask(MessageKind.HELLO)
            assert hello.kind == MessageKind.HELLO, hello
        (frame,) = self._talker.ask(MessageKind.STEP, requests[self._n])
        assert frame.kind == MessageKind.STEP, frame
        self._n += 1
        return _outcome(unpack_result(frame.payload).result) == results[self._n - 1]

    def close(self) -> None:
        if self._talker is not None:
            self._talker.close()
            self._talker = None


@cache
def _honest(kind: str) -> HonestClient:
    return HonestClient(kind)


# ---- hostile sides -------------------------------------------------------------------------------


def _beside_a_client(kind: str, random: np.random.Generator) -> list[bool]:
    """Beside a client, send frames with any bytes changed; where there is a key, without it."""
    before = _honest(kind).step()
    requests, _ = reference()
    for i in range(N_FRAMES):
        stranger = Talker(server_of(kind))
        nonce = new_nonce() if kind == "key" and random.random() < 0.8 else b""
        hello = pack_frame(MessageKind.HELLO, 0, nonce)
        step = pack_frame(MessageKind.STEP, 1, requests[i])
        stream = (hello, hello + step, hello + hello)[random.integers(3)]
        stranger.send(damaged_bytes(stream, random))
        for frame in stranger.frames():
            assert frame.kind in (MessageKind.ERROR, MessageKind.CHALLENGE), frame
            if frame.kind == MessageKind.ERROR:
                assert unpack_error(frame.payload)
        stranger.close()
    return [before, _honest(kind).step()]


def _as_client(random: np.random.Generator) -> list[bool]:
    """As the client, send requests of which only the content is wrong; then leave."""
    _honest("open").close()
    client = _new_client(random)
    for i in range(N_FRAMES):
        if not client.is_open:
            client.close()
            client = _new_client(random)
        if random.random() < 0.03:
            request = pack_frame(MessageKind.STEP, client.sequence, reference()[0][i])
            client.send(damaged_bytes(request, random))
            client.sequence += 1
            frames = client.frames()
        else:
            frames = client.ask(*_damaged_request(client, random))
        for frame in frames:
            assert frame.kind & ~MORE in MessageKind.__members__.values(), frame
            if frame.kind == MessageKind.ERROR:
                assert unpack_error(frame.payload)
    client.close()
    later = [_honest("open").step(), _honest("open").step()]
    _honest("open").close()
    return later


def _new_client(random: np.random.Generator) -> Talker:
    """Return a client that leads as many frames and geoms as it says."""
    client = Talker(server_of("open"))
    (hello,) = client.ask(MessageKind.HELLO)
    assert hello.kind == MessageKind.HELLO, unpack_error(hello.payload)
    client.n_frames = client.n_geoms = 0
    for kind, content in _ADDITIONS.items():
        if random.random() < 0.3:
            (reply,) = client.ask(kind, content)
            assert reply.kind == kind, unpack_error(reply.payload)
            client.n_frames += kind != MessageKind.COLLIDE
            client.n_geoms += kind == MessageKind.COLLIDE
    return client


_JAW = Geom("jaw", "box", (0.01, 0.002, 0.005), 0.6)
_PLACE_OF_JAW = GeomPoses(np.array([[0.02, 0.03, 0.05]]), np.eye(3)[None])
_NOTHING = GeomPoses(np.zeros((0, 3)), np.zeros((0, 3, 3)))
_POSE = FramePose(np.array([0.01, 0.01, 0.02]), np.eye(3))
_ADDITIONS = {
    MessageKind.ATTACH: ATTACHMENT.pack(FrameAttachment("top", 500.0, 5.0, 2.0)),
    MessageKind.TIE: TIE.pack(
        FrameTie(np.array([[0.01, 0.01, 0.02]]), np.array([[0.01, 0.01, 0.05]]), 200.0, 2e-6, 200.0)
    ),
    MessageKind.COLLIDE: pack_geoms([_JAW], _PLACE_OF_JAW),
}


def _damaged_request(client: Talker, random: np.random.Generator) -> tuple[int, bytes]:
    """Return kind and payload of a request that is wrong in places; its checksums are right."""
    choice = random.random()
    if choice < 0.5:
        sweep = _sweep(random.integers(N_HONEST_STEPS)) if random.random() < 0.8 else None
        jaw = _PLACE_OF_JAW if client.n_geoms else _NOTHING
        step = pack_step(sweep, DT, client.n_frames * [_POSE], jaw)
        return MessageKind.STEP, _damaged_content(step, random)
    if choice < 0.8:
        kind = list(_ADDITIONS)[random.integers(3)]
        return kind, _damaged_content(_ADDITIONS[kind], random)
    if choice < 0.9:
        kind = int(random.choice([*MessageKind, 0, 19, 99, 0x7FFF, 0xFFFF]))
        return kind | (MORE if random.random() < 0.1 else 0), b""
    return int(random.choice(list(MessageKind))), random.bytes(int(random.choice([1, 8, 64, 5000])))


class CheckedBlade:
    """What a device drives, as `DrivenBlade`: it accepts nothing that a blade could not do."""

    def servo_cp(self, pose: CartesianPose, *, holds: bool, period: float) -> None:
        assert holds in (True, False) and 0.0 < period <= 1.0
        assert (np.abs(pose.position) <= 1000.0).all()
        assert abs(np.linalg.norm(pose.orientation) - 1.0) < 1e-9

    def release(self) -> None:
        """Nothing is held here."""

    def lose_client(self) -> None:
        """Nothing is held here."""

    def end(self) -> None:
        """Nothing ends here."""

    def state(self) -> object:
        return STATE


def _as_device(random: np.random.Generator) -> list[bool]:
    """Send damaged poses to a run; what comes back is a state or an error."""
    server = server_of("device")
    device = Talker(server)
    device.ask(MessageKind.HELLO)
    at = CartesianPose(np.array([0.1, 0.2, 0.3]), np.array([0.6, 0.0, 0.8, 0.0]))
    for i in range(N_FRAMES):
        if not device.is_open:
            device.close()
            device = Talker(server)
            device.ask(MessageKind.HELLO)
        good = SERVO.pack(ServoRequest(1e-3 * i, 1e-3, at, True))
        choice = random.random()
        if choice < 0.7:
            frames = device.ask(MessageKind.SERVO, _damaged_content(good, random))
        elif choice < 0.9:
            device.send(damaged_bytes(pack_frame(MessageKind.SERVO, device.sequence, good), random))
            device.sequence += 1
            frames = device.frames()
        else:
            frames = device.ask(int(random.integers(0, 1 << 16)), random.bytes(8))
        for frame in frames:
            if frame.kind == MessageKind.SERVO:
                assert DEVICE_STATE.unpack(frame.payload).time == STATE.time
            elif frame.kind == MessageKind.ERROR:
                assert unpack_error(frame.payload)
    device.close()
    honest = Talker(server)
    (hello,) = honest.ask(MessageKind.HELLO)
    (reply,) = honest.ask(MessageKind.SERVO, good)
    assert reply.kind == MessageKind.SERVO
    honest.close()
    place = DEVICE_STATE.unpack(reply.payload).measured_cp.position.tolist()
    return [hello.kind == MessageKind.HELLO, place == [0.1, 0.2, 0.3]]


# ---- damage --------------------------------------------------------------------------------------


def damaged_bytes(stream: bytes, random: np.random.Generator) -> bytes:
    """Return a stream with some bytes changed, and sometimes a part omitted or repeated."""
    changed = bytearray(stream)
    for at in random.integers(0, len(changed), random.integers(1, 5)):
        changed[at] ^= random.integers(1, 256)
    a, b = np.sort(random.integers(0, len(changed) + 1, 2))
    parts = (changed, changed, changed[:b], changed[:a] + changed[b:], changed[:b] + changed[a:])
    return bytes(parts[random.integers(len(parts))])


def _damaged_content(payload: bytes, random: np.random.Generator) -> bytes:
    """Return a content with fields, numbers of arrays or bytes replaced."""
    if random.random() < 0.15:
        return damaged_bytes(payload, random)
    content = msgspec.msgpack.decode(payload)
    for _ in range(random.integers(1, 4)):
        part, key = content, None
        while isinstance(part, (dict, list)) and len(part):
            inner = part
            key = random.choice(list(part)) if isinstance(part, dict) else 0
            part = part[key]
            if random.random() < 0.1:
                break
        if key is None:
            break
        inner[key] = _damaged_part(part, random)
    return msgspec.msgpack.encode(content)[:LARGEST_FRAME]


def _damaged_part(part: Any, random: np.random.Generator) -> Any:
    """Return another value for a part: another number or length of an array, or anything."""
    choice = random.random()
    if isinstance(part, bytes) and part and choice < 0.85:
        changed, at = bytearray(part), 8 * int(random.integers(-(-len(part) // 8)))
        if choice < 0.5:
            changed[at : at + 8] = RAW[random.integers(len(RAW))]
        elif choice < 0.65:
            number = struct.unpack("<d", (part[at : at + 8] + bytes(8))[:8])[0]
            changed[at : at + 8] = struct.pack("<d", number * 10.0 ** random.uniform(-4.0, 4.0))
        elif choice < 0.8:
            changed[int(random.integers(len(part)))] ^= 1 << int(random.integers(8))
        else:
            del changed[at:]
        return bytes(changed)
    if isinstance(part, float) and choice < 0.3:
        return part * 10.0 ** random.uniform(-4.0, 4.0)
    return copy.deepcopy(VALUES[random.integers(len(VALUES))])
