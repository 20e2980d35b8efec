"""A live run in another process, and what a page does to lead it."""

import os
import re
import subprocess
import sys
import urllib.request

from tornado.httpclient import HTTPRequest
from tornado.websocket import websocket_connect


class LiveView:
    """A `scalpel-sim view` in another process."""

    def __init__(self, scene, folder, *options):
        self.folder = folder
        command = [sys.executable, "-m", "scalpel_sim", "view", scene]
        self.process = subprocess.Popen(
            [*command, *options, "--out", str(folder)],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)},
        )
        self.url = re.search(r"http://127\.0\.0\.1:\d+/", self.line_with("http://")).group()

    def line_with(self, text):
        """Wait for a line of the log, and return it."""
        for line in self.process.stderr:
            if text in line:
                return line
        raise AssertionError(f"it ended without saying '{text}'")

    def wait_for_files(self):
        self.line_with("stays until Ctrl-C")

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()


class DrivenView(LiveView):
    """A `scalpel-sim view --hand live` in another process."""

    def __init__(self, scene, folder, *options):
        super().__init__(scene, folder, "--hand", "live", *options)


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
