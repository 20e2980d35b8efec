"""A live run in another process, and what a page does to lead it."""

import re
import subprocess
import urllib.request

from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect

from scalpel_sim.cli.app import command_line
from scalpel_sim.runs.file_names import SCENE
from tests.support.processes import PROGRAM, environment, free_port
from tests.support.run_files import assert_same_run


class ProcessOfARun:
    """The program in another process; its log is read on."""

    def __init__(self, folder, *words):
        self.folder = folder
        self.process = subprocess.Popen(
            [*PROGRAM, *words, "--out", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env=environment(),
        )

    def line_with(self, text):
        """Wait for a line of the log, and return it."""
        lines = []
        for line in self.process.stderr:
            lines.append(line)
            if text in line:
                return line
        raise AssertionError(f"it ended without saying '{text}', but {lines}")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()


class DeviceRunProcess(ProcessOfARun):
    """A run that waits for a device."""

    def __init__(self, command, folder, *options, scene="grid2"):
        hand = ["--hand", "device", "--listen", "127.0.0.1:0"]
        super().__init__(folder, command, scene, *hand, *options)
        self.address = self.line_with("waiting for a device at").split()[-1]


class LiveView(ProcessOfARun):
    """A `scalpel-sim view`.

    Its port is none that another view of these tests had: a page of that one may be open, waits
    there for the next run, and would lead it.
    """

    def __init__(self, scene, folder, *options):
        super().__init__(folder, "view", scene, "--port", str(free_port()), *options)
        self.url = re.search(r"http://127\.0\.0\.1:\d+/", self.line_with("http://")).group()

    def wait_for_files(self):
        self.line_with("stays until Ctrl-C")


class DrivenView(LiveView):
    """A `scalpel-sim view --hand live`."""

    def __init__(self, scene, folder, *options):
        super().__init__(scene, folder, "--hand", "live", *options)


def assert_a_run_repeats(led, folder):
    """Do what was recorded once more, and compare the bits."""
    assert command_line(["run", str(led / SCENE), "-q", "--out", str(folder)]) == 0
    assert_same_run(led, folder)


def document(url):
    """Return the document of a page."""
    with urllib.request.urlopen(url) as answer:
        return answer.read().decode()


def token_in(url):
    """Return the token in the document of a page that leads."""
    return re.search(r'const TOKEN = "([\w-]{40,})"', document(url)).group(1)


async def page_of(url, origin, token):
    """Return an open socket of a page of that origin."""
    address = url.replace("http", "ws", 1) + f"frames?token={token}"
    headers = {} if origin is None else {"Origin": origin}
    return await websocket_connect(HTTPRequest(address, headers=headers))
