import os
import subprocess
import sys
from pathlib import Path

import hypothesis
import numpy as np
import pytest

from bridge.tcp.keys import KEY_VARIABLE
from tissue import BladeSegment

# A busy machine must not fail a test.
hypothesis.settings.register_profile("no deadline", deadline=None)
hypothesis.settings.load_profile("no deadline")

ROOT = Path(__file__).parents[2]
PATIENCE = 60.0
"""Time in which a process ends on a busy machine [s]."""

SERVE_BLOCK = Path(__file__).with_name("tcp") / "serve_block.py"


class ServerProcess:
    """A tissue server in a second process."""

    def __init__(self, host: str = "127.0.0.1", key: bytes | None = None) -> None:
        path = os.pathsep.join(filter(None, [str(ROOT), os.environ.get("PYTHONPATH")]))
        self.process = subprocess.Popen(
            [sys.executable, str(SERVE_BLOCK), host],
            env=os.environ | {"PYTHONPATH": path} | ({KEY_VARIABLE: key.hex()} if key else {}),
            stdout=subprocess.PIPE,
            text=True,
        )
        self.address = self.process.stdout.readline().strip()

    def end(self, number: int) -> int:
        """Send a signal and return the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        try:
            return self.process.wait(PATIENCE)
        finally:
            self.process.kill()
            self.process.stdout.close()


@pytest.fixture
def start_server():
    servers = []

    def start(**options):
        servers.append(ServerProcess(**options))
        return servers[-1]

    yield start
    for server in servers:
        server.end(15)


@pytest.fixture(scope="module")
def server():
    running = ServerProcess()
    yield running
    assert running.process.poll() is None, "the server did not survive its clients"
    running.end(15)


@pytest.fixture
def upright():
    """Return a function that makes an upright blade, longer than the block is high, facing +y."""

    def at(x: float, y: float, bottom: float = -0.005) -> BladeSegment:
        return BladeSegment(
            np.array([x, y, bottom]), np.array([x, y, bottom + 0.03]), np.array([0.0, 1.0, 0.0])
        )

    return at
