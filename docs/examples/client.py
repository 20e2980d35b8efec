"""Cuts a tissue that `scalpel-sim serve` holds: pip install msgpack, python client.py [PORT]."""

import socket
import struct
import sys
import time
import zlib

import msgpack

HELLO, STEP, ERROR = 1, 2, 6


def connected(port):
    """Return a connection to the server, which may still be getting ready."""
    for k in range(240):  # two minutes
        try:
            return socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            if k == 0:
                print(f"waiting for `scalpel-sim serve` at port {port}", flush=True)
            time.sleep(0.5)
    sys.exit(f"no `scalpel-sim serve` at port {port}")


def ask(sequence, kind, payload=b""):
    """Return the content of the reply to a request."""
    head = struct.pack("<4sHHIII", b"SCUT", 12, kind, sequence, len(payload), zlib.crc32(payload))
    connection.sendall(head + struct.pack("<I", zlib.crc32(head)) + payload)
    head = connection.recv(24, socket.MSG_WAITALL) or sys.exit("the server has gone")
    _, _, answer, _, length, checksum, _ = struct.unpack("<4sHHIIII", head)
    reply = connection.recv(length, socket.MSG_WAITALL) if length else b""
    if answer == ERROR or zlib.crc32(reply) != checksum:
        sys.exit(reply.decode(errors="replace"))
    return msgpack.unpackb(reply)


connection = connected(int([*sys.argv, "8766"][1]))
connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
x0, y0, z0, x1, y1, z1 = struct.unpack("<6d", ask(0, HELLO)["bounds"])
x, y, bottom, forward = (x0 + x1) / 2, y0 - 2e-3, z0 - 5e-3, (0.0, 1.0, 0.0)  # upright
pose = (x, y, bottom, x, y, z1 + 5e-3, *forward)
for frame in range(1, 1001):  # 1 ms each, at 60 mm/s along y
    before, y = pose, y + 60e-6
    pose = (x, y, bottom, x, y, z1 + 5e-3, *forward)
    step = {"dt": 1e-3, "blade": struct.pack("<18d", *before, *pose)}
    result = ask(frame, STEP, msgpack.packb(step))["result"]
    force, area = struct.unpack("<3d", result["wrench"]["force"]), result["cut_area"]
    if frame % 100 == 0:
        print(f"{frame} ms: {force[1]:+.3f} N along y, {area * 1e6:.0f} mm2 cut")
