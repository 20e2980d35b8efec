"""Delays between processes: a step over TCP, and the page of a mouse."""

import contextlib
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from operator import methodcaller
from pathlib import Path

import numpy as np

from benchmarks.timing import TurnWatch, time_calls
from bridge import InProcessLink, TcpLink, TissueLink, serve
from scalpel_sim.validate.speed.measurements import BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows
from scalpel_sim.validate.speed.watch import SILENT
from tissue import BladeSegment, BladeSweep, FloatArray, Tissue, block

_KEY = bytes(range(32))
_DT = 1e-4
"""Time step over TCP [s]: one Runge-Kutta step of the cell."""
_N_WARM_UP = 200
_SIDE = 0.01
"""Side of the cell [m]."""

_N_MOVES = 400
_SECONDS_PER_MOVE = 0.015
_SETTLING = 2.0
"""Until the page has found how coarsely it has to draw [s]."""

_ABOUT_TCP = (
    "The tissue is one cell in a second process, as with `scalpel-sim serve`. Link alone: the "
    "smallest request, the number of pieces. Then steps without a blade, with one above the tissue "
    "and with one in it, whose contacts are sent too. The link costs cache misses as well, since "
    "the other process has used the cache in between."
)


def round_trip(*, watch: TurnWatch = SILENT, steps: int = 4000) -> BenchmarkResult:
    """Time a step over TCP, with a key and without, and the same step in process.

    Args:
        watch: Receives the progress.
        steps: Number of samples of each case.
    """
    with contextlib.ExitStack() as stack:
        links: dict[str, TissueLink] = {"in process": InProcessLink(_cell())}
        for name, key in (("over TCP", None), ("with a key", _KEY)):
            words = [] if key is None else ["key"]
            command = [sys.executable, "-c", "from benchmarks.links import serve_cell as s; s()"]
            server = subprocess.Popen([*command, *words], stdout=subprocess.PIPE, text=True)
            stack.callback(server.wait)
            stack.callback(server.terminate)
            assert server.stdout is not None
            links[name] = TcpLink(server.stdout.readline().strip(), key=key)
        for link in links.values():
            stack.callback(link.close)
        poses = {"above": _upright(0.5 * _SIDE, _SIDE), "inside": _upright(0.3 * _SIDE, -_SIDE)}
        watch.begin(len(links) * (2 + len(poses)))
        rows = Rows("round-trip")

        def measure(what: str, ask: Callable[[TissueLink], object]) -> None:
            for name, link in links.items():
                time_calls(partial(ask, link), _N_WARM_UP)
                rows.times(f"{what}, {name}", 6, [time_calls(partial(ask, link), steps)], "µs")
                watch.tick(f"{what}, {name}")

        measure("link alone", methodcaller("n_pieces"))
        measure("no blade", methodcaller("step", None, _DT))
        for where, pose in poses.items():
            for link in links.values():
                _draw_in(link, pose)
            sweep = BladeSweep(pose, pose)
            measure(f"blade {where}", methodcaller("step", sweep, _DT))
    return rows.table("round trip", _ABOUT_TCP)


def serve_cell() -> None:
    """Serve the cell over TCP and print the address: the other process of `round_trip`."""
    key = _KEY if "key" in sys.argv else None
    serve(_cell, port=0, key=key, on_listening=lambda address: print(address, flush=True))


def _cell() -> Tissue:
    """Return one cell of six tetrahedra, held by its lowest nodes, at rest."""
    mesh = block((1, 1, 1), (_SIDE, _SIDE, _SIDE))
    return Tissue(mesh, fixed=mesh.positions[:, 2] == 0.0, gravity=(0.0, 0.0, 0.0))


def _upright(y: float, z: float) -> BladeSegment:
    """Return an upright edge in the middle of the cell that faces along y."""
    tip = np.array([0.4 * _SIDE, y, z])
    return BladeSegment(tip, tip + np.array([0.0, 0.0, 3.0 * _SIDE]), np.array([0.0, 1.0, 0.0]))


def _draw_in(link: TissueLink, pose: BladeSegment) -> None:
    """Move the blade to a pose from in front of the cell."""
    before = None
    for y in np.linspace(-0.1 * _SIDE, pose.tip[1], 200):
        shift = np.array([0.0, y - pose.tip[1], 0.0])
        after = pose._replace(tip=pose.tip + shift, heel=pose.heel + shift)
        link.step(BladeSweep(before or after, after), 1e-3)
        before = after


def lag(*scenes: str, width: int = 480, height: int = 360) -> BenchmarkResult:
    """Time from a movement of the mouse to the picture that contains it, in headless Chromium.

    It draws by software, and the mouse moves every 15 ms. Each lag ends when the picture is drawn.

    Args:
        scenes: Scenes [default: grid2, organ].
        width: Width of the window [pixels].
        height: Height of the window [pixels].
    """
    from tests.scalpel_sim.hands.driven_view import DrivenView

    rows, notes = Rows("lag"), []
    for scene in scenes or ("grid2", "organ"):
        with tempfile.TemporaryDirectory() as folder, DrivenView(scene, Path(folder)) as view:
            lags, note = _lags_in(view.url, width, height)
        rows.times(scene, None, [lags], quantity="lag")
        notes.append(f"{scene}: {note}")
    return rows.table("lag of the picture", "; ".join(notes))


_COUNT_PICTURES = """() => {
    window.nPictures = 0;
    window.since = performance.now();
    const draw = viewer.handle_command_bytearray.bind(viewer);
    viewer.handle_command_bytearray = (bytes) => { window.nPictures += 1; draw(bytes); };
}"""


def _lags_in(url: str, width: int, height: int) -> tuple[FloatArray, str]:
    """Return the lags [s], and the pictures a second with the speed of the run, as a text."""
    from playwright.sync_api import sync_playwright

    from tests.support.browser import DETERMINISTIC, NAMES, first_installed

    with sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=first_installed(NAMES), args=list(DETERMINISTIC)
        )
        # It waits for texts, which the policy of the page forbids to evaluate.
        tab = chromium.new_page(viewport={"width": width, "height": height}, bypass_csp=True)
        tab.goto(url)
        tab.wait_for_function("hand.isClosed && element('loading').hidden")
        x, y = width / 2, 0.45 * height
        tab.mouse.move(x, y)
        tab.mouse.down()
        for i in range(round(_SETTLING / _SECONDS_PER_MOVE)):
            tab.mouse.move(x + i % 3, y)
            time.sleep(_SECONDS_PER_MOVE)
        tab.evaluate("hand.lags.length = 0")
        tab.evaluate(_COUNT_PICTURES)
        for i in range(_N_MOVES):
            drawn = 60.0 * (i % 100) / 100.0
            tab.mouse.move(x + drawn, y + drawn)
            time.sleep(_SECONDS_PER_MOVE)
        rate = tab.evaluate("1000 * nPictures / (performance.now() - since)")
        tab.wait_for_function("hand.unshown.length === 0")
        found, pace = 1e-3 * np.array(tab.evaluate("hand.lags")), tab.inner_text("#pace")
        tab.close()
        chromium.close()
    return found, f"{rate:.1f} pictures a second, {pace}"
