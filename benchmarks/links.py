"""Delays between processes: a step over TCP, a device that leads the blade, the page of a mouse."""

import contextlib
import math
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from functools import partial
from operator import methodcaller
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.timing import TurnWatch, time_calls
from bridge import DeviceClient, DeviceState, InProcessLink, LinkError, TcpLink, TissueLink, serve
from scalpel_sim.validate.speed.measurements import COUNTED, WALL, BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows
from scalpel_sim.validate.speed.watch import SILENT
from tissue import BladeSegment, BladeSweep, FloatArray, Tissue, block

_KEY = bytes(range(32))
_DT = 1e-4
"""Time step over TCP [s]: one Runge-Kutta step of the cell."""
_N_WARM_UP = 200
_SIDE = 0.01
"""Side of the cell [m]."""

_PERIOD = 1e-3
"""Period of the device [s]."""
_REACH = np.array([0.004, 0.03, 0.008])
"""Amplitude of the stylus along x, y and z [m]."""
_RATES = np.array([1.3, 0.7, 2.1])
"""How fast it goes to and fro [rad/s]."""
_SPURT = 10.0
"""Every so many seconds the stylus goes at ten times the speed for a tenth of a second [s]."""
_ROUNDING = 1e-6
"""Share by which a limit may be passed: what the digits of the record leave."""
_STILL = np.array([1.0, 0.0, 0.0, 0.0])
"""A stylus that is not turned."""

_N_MOVES = 400
_SECONDS_PER_MOVE = 0.015
_SETTLING = 2.0
"""Until the page has found how coarsely it has to draw [s]."""

_MISBEHAVIOUR: dict[str, Callable[[DeviceClient], object]] = {
    "silence": lambda client: None,
    "NaN": lambda client: client.servo_cp(np.full(3, np.nan), _STILL),
    "a jump of 10 m": lambda client: client.servo_cp(np.array([0.0, 10.0, 0.0]), _STILL),
}
"""Faults of a device that has led."""

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


def device_link(scene: str = "organ", /, *, seconds: float = 60.0) -> BenchmarkResult:
    """Time the link of a device that leads the blade, and count what passes a limit.

    A fake device in this process leads the blade of `scalpel-sim run --hand device` in another one,
    a thousand poses a second: to and fro through the body, in bends, with turns, and now and then
    faster than the blade may. In the record of the run no step of the blade may be faster than its
    limits.

    Args:
        scene: Scene.
        seconds: Wall time [s].
    """
    with tempfile.TemporaryDirectory() as folder:
        command = ["run", scene, "--hand", "device", "--listen", "127.0.0.1:0", "--quiet"]
        run = subprocess.Popen(
            [sys.executable, "-m", "scalpel_sim", *command, "--out", folder],
            stderr=subprocess.PIPE,
            text=True,
        )
        assert run.stderr is not None
        address = next(line for line in run.stderr if "waiting for a device" in line).split()[-1]
        with DeviceClient(address, period=_PERIOD) as client:
            taken, state = _lead(client, seconds)
            limits = client.description
            rests = {name: _time_to_rest(client, act) for name, act in _MISBEHAVIOUR.items()}
            client.end()
        run.communicate()
        stroke = np.genfromtxt(Path(folder) / "stroke.csv", delimiter=",", names=True)
        forces = np.genfromtxt(Path(folder) / "forces.csv", delimiter=",", names=True)
    speed, turn_rate = _fastest(stroke)
    force = np.sqrt(sum(forces[f"force_{axis}_n"] ** 2 for axis in "xyz")).max()
    passed = (speed > (1.0 + _ROUNDING) * limits.most_speed) + (
        turn_rate > (1.0 + _ROUNDING) * limits.most_turn_rate
    )
    rows = Rows("device-link")
    rows.times("request to reply", None, [taken])
    for case, unit, value in (
        *((f"until rest after {name}", "ms", 1e3 * rest) for name, rest in rests.items()),
        (f"fastest, limit {limits.most_speed:g}", "m/s", speed),
        (f"fastest turn, limit {limits.most_turn_rate:g}", "rad/s", turn_rate),
        ("limits passed", "", passed),
        ("periods missed", "", state.n_missed),
        ("messages dropped", "", state.n_dropped),
        ("frames limited", "", state.n_limited),
        ("largest force", "N", force),
        ("cut", "mm2", 1e6 * forces["cut_area_m2"][-1]),
    ):
        clock = WALL.name if unit == "ms" else COUNTED
        rows.values(case, None, [float(value)], unit, clock=clock)
    about = f"{len(taken):,} poses in {seconds:g} s, {state.time:.1f} s simulated."
    return rows.table(scene, about)._replace(is_right=not passed)


def _lead(client: DeviceClient, seconds: float) -> tuple[FloatArray, DeviceState]:
    """Lead for so many seconds, and return the time of each reply [s], and the last state."""
    state = client.measured()
    taken, start = [], time.monotonic()
    due, stylus, before = start, 0.0, start
    while (now := time.monotonic()) - start < seconds:
        is_spurt = (now - start) % _SPURT > _SPURT - 0.1
        stylus += (10.0 if is_spurt else 1.0) * (now - before)
        before = now
        position = _REACH * np.sin(_RATES * stylus)
        angle = 0.1 * math.sin(stylus)
        orientation = np.array([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])
        state = client.servo_cp(position, orientation)
        taken.append(time.monotonic() - now)
        due = max(due + _PERIOD, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    return np.array(taken), state


def _time_to_rest(client: DeviceClient, misbehave: Callable[[DeviceClient], object]) -> float:
    """Return the wall time from the last good pose until nobody leads the blade [s]."""
    for k in range(100):
        client.servo_cp(np.array([0.0, 1e-5 * k, 0.0]), _STILL)
    last = time.monotonic()
    with contextlib.suppress(LinkError):
        misbehave(client)
    while client.measured().is_engaged:
        pass
    return time.monotonic() - last


def _fastest(rows: np.ndarray[Any, Any]) -> tuple[float, float]:
    """Return the highest speed of the middle of the edge [m/s], and its turn rate [rad/s]."""
    parts = [np.stack([rows[f"{p}_{a}"] for a in "xyz"], 1) for p in ("tip", "heel", "forward")]
    tip, heel, forward = parts
    steps = np.diff(rows["t"])
    along = (tip - heel) / np.linalg.norm(tip - heel, axis=1)[:, None]
    axes = np.stack([along, forward, np.cross(along, forward)], 1)
    middle = 0.5 * (tip + heel)
    speeds = np.linalg.norm(np.diff(middle, axis=0), axis=1) / steps
    # |R1 - R0| in the norm of Frobenius is 2 sqrt(2) sin(angle / 2).
    chords = np.linalg.norm(np.diff(axes, axis=0), axis=(1, 2)) / (2.0 * math.sqrt(2.0))
    return float(speeds.max()), float((2.0 * np.arcsin(chords) / steps).max())


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
        tab.wait_for_function("hand.isClosed")
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
