"""Drives the blade of `scalpel-sim run --hand device`; needs msgpack: python device.py [PORT]."""

import socket
import struct
import sys
import time
import zlib

import msgpack

HELLO, ERROR, SERVO, MEASURED, END = 1, 6, 16, 17, 18
PERIOD, SPEED, SECONDS = 1e-3, 0.02, 3.0  # s, m/s, s


def connected(port):
    """Return a connection to the run, which may still be getting ready."""
    for k in range(240):  # two minutes
        try:
            return socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            if k == 0:
                print(f"waiting for `scalpel-sim run --hand device` at port {port}", flush=True)
            time.sleep(0.5)
    sys.exit(f"no `scalpel-sim run --hand device` at port {port}")


def ask(sequence, kind, payload=b""):
    """Return the content of the reply to a request."""
    head = struct.pack("<4sHHIII", b"SCUT", 12, kind, sequence, len(payload), zlib.crc32(payload))
    connection.sendall(head + struct.pack("<I", zlib.crc32(head)) + payload)
    head = connection.recv(24, socket.MSG_WAITALL) or sys.exit("the run has gone")
    _, _, answer, _, length, checksum, _ = struct.unpack("<4sHHIIII", head)
    reply = connection.recv(length, socket.MSG_WAITALL)
    if answer == ERROR or zlib.crc32(reply) != checksum:
        sys.exit(reply.decode(errors="replace"))
    return msgpack.unpackb(reply)


connection = connected(int([*sys.argv, "8767"][1]))
connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
print(ask(0, HELLO))
pose = ask(1, MEASURED)["measured_cp"]
x, y, z = struct.unpack("<3d", pose["position"])
start = time.monotonic()
for k in range(round(SECONDS / PERIOD)):
    now = time.monotonic() - start
    pose["position"] = struct.pack("<3d", x, y + SPEED * min(now, SECONDS), z)  # read yours here
    servo = {"stamp": now, "period": PERIOD, "servo_cp": pose, "holds": True}
    state = ask(2 + k, SERVO, msgpack.packb(servo))
    force = struct.unpack("<3d", state["measured_cf"]["force"])  # exert it here
    if k % 300 == 0:
        tip = struct.unpack("<3d", state["measured_cp"]["position"])
        print(f"{state['time']:.3f} s: tip at y {1e3 * tip[1]:+.1f} mm, {force[1]:+.3f} N along y")
    time.sleep(max(0.0, start + (k + 1) * PERIOD - time.monotonic()))
end = ask(2 + k + 1, END)
print(f"frames limited {end['n_limited']}, periods missed {end['n_missed']}, ", end="")
print(f"messages dropped {end['n_dropped']}")
