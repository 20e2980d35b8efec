"""A process of its own that answers a device: however long a frame takes, or if the run stands.

A thread of the run would share its interpreter, and stand still with it.
"""

import contextlib
import gc
import json
import logging
import os
import subprocess
import sys
import tempfile
import threading
from pathlib import Path
from typing import IO, NamedTuple, cast

from bridge.coupling.limits import DeviceLimits
from bridge.device.exchange import DeviceCommand, Exchange
from bridge.device.felt_force import BladeReport
from bridge.device.messages import DeviceDescription
from bridge.device.remote_blade import RemoteBlade
from bridge.device.server import DeviceServer
from bridge.link import LinkError

SECONDS_PER_COUNT = 0.05
"""Time between two looks at what was counted [s]."""

_SHARED_MEMORY = Path("/dev/shm")
"""A folder in memory, where the system has one: the disk has no part in what is exchanged."""

_PROGRAM = "from bridge.device.process import answer_a_device; answer_a_device()"


class DeviceEnd(NamedTuple):
    """Description of a run for the process."""

    description: DeviceDescription
    """Description of it for a device."""
    limits: DeviceLimits
    """Largest force and torque that it gets."""
    lever: float
    """Half the length of the edge [m]."""


class DeviceProcess:
    """The process that answers a device, and the memory that it shares with this one.

    It ends when it is closed, or when this process ends in any way.

    Args:
        end: The run.
        first: How the blade is at first.
        host: Host to listen on; without a key only loopback.
        port: Port to listen on; 0 for a free one.
        key: Key that a device must have too; None to serve any device on this machine.

    Raises:
        ValueError: the host is not on loopback and there is no key, or the port is out of range.
        LinkError: the port is in use or not allowed, or the process could not begin.
    """

    def __init__(
        self, end: DeviceEnd, first: BladeReport, host: str, port: int, key: bytes | None
    ) -> None:
        folder = _SHARED_MEMORY if os.access(_SHARED_MEMORY, os.W_OK) else None
        with tempfile.NamedTemporaryFile(prefix="scalpel-sim-", dir=folder) as file:
            file.truncate(Exchange.SIZE)
            self._exchange = Exchange(Path(file.name))
            self._exchange.report = first
            # A session of its own: the Ctrl-C that ends a run must not end the answers before.
            self._process = subprocess.Popen(
                [sys.executable, "-c", _PROGRAM],
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                text=True,
                start_new_session=True,
                env={
                    **os.environ,
                    "PYTHONPATH": os.pathsep.join(path for path in sys.path if path),
                },
            )
            request = {
                "memory": file.name,
                "description": end.description._asdict(),
                "limits": [end.limits.force, end.limits.torque],
                "lever": end.lever,
                "listen": [host, port],
                "key": None if key is None else key.hex(),
                "level": logging.getLogger().getEffectiveLevel(),
            }
            try:
                self.address = self._begun(json.dumps(request))
                """Address at which it listens, "HOST:PORT"."""
            except BaseException:
                self.close()
                raise

    def __enter__(self) -> "DeviceProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def command(self) -> DeviceCommand:
        """Return what the device wants.

        Raises:
            LinkError: the process has ended.
        """
        code = self._process.poll()
        if code is not None:
            raise LinkError(f"the process that answers the device has ended (exit code {code})")
        return self._exchange.command

    def tell(self, report: BladeReport) -> None:
        """Pass on how the blade is."""
        self._exchange.report = report

    def close(self) -> None:
        """End the process."""
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            cast(IO[str], pipe).close()
        self._exchange.close()

    def _begun(self, request: str) -> str:
        """Return the address at which the process listens.

        Raises:
            ValueError: see above.
            LinkError: see above.
        """
        stdin, stdout = cast(IO[str], self._process.stdin), cast(IO[str], self._process.stdout)
        try:
            stdin.write(request + "\n")
            stdin.flush()
            line = stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise LinkError("the process that answers the device did not begin")
        answer = json.loads(line)
        if "address" not in answer:
            raise (ValueError if answer["is_value"] else LinkError)(answer["error"])
        return str(answer["address"])


def answer_a_device() -> None:
    """Answer a device as the run on standard input requests, until that closes."""
    request = json.loads(sys.stdin.readline())
    logging.addLevelName(logging.WARNING, "warning")
    logging.basicConfig(level=request["level"], format="%(levelname)s: %(message)s")
    host, port = request["listen"]
    exchange = Exchange(Path(request["memory"]))
    description = DeviceDescription(**request["description"])
    blade = RemoteBlade(
        exchange, DeviceLimits(*request["limits"]), request["lever"], description.watchdog
    )
    key = None if request["key"] is None else bytes.fromhex(request["key"])
    try:
        server = DeviceServer(blade, description, host=host, port=port, key=key)
    except (ValueError, LinkError) as error:
        print(json.dumps({"error": str(error), "is_value": isinstance(error, ValueError)}))
        return
    _take_precedence()
    print(json.dumps({"address": server.address}), flush=True)
    threading.Thread(target=_end_with_the_run, daemon=True).start()
    while True:
        server.serve_for(SECONDS_PER_COUNT)
        blade.count(*server.counts)


def _take_precedence() -> None:
    """Take precedence over what else the machine does, where the system allows that.

    An answer takes a third of a millisecond. On a busy machine one in fifty waits for some others'
    without it.
    """
    gc.freeze()  # what is loaded stays: later collections need not look at it
    if hasattr(os, "sched_setscheduler"):
        with contextlib.suppress(OSError):
            os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))


def _end_with_the_run() -> None:
    """Wait until the run closes the pipe, or ends, and end this process."""
    while os.read(sys.stdin.fileno(), 1):
        pass
    os._exit(0)
