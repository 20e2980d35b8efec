"""A device that leads the blade of a run: how soon it is answered, and how smooth its force is."""

import contextlib
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from bridge import DeviceClient, DeviceState, LinkError
from scalpel_sim.hands.device_hand import MOST_HURRY
from scalpel_sim.validate.speed.measurements import COUNTED, WALL, BenchmarkResult
from scalpel_sim.validate.speed.tables import Rows
from tissue import FloatArray

_PERIOD = 1e-3
"""Period of the device [s]."""
_REACH = np.array([0.004, 0.03, 0.008])
"""Amplitude of the stylus along x, y and z [m]."""
_RATES = np.array([1.3, 0.7, 2.1])
"""Angular frequency of its way to and fro [rad/s]."""
_SPURT = 10.0
"""Every so many seconds the stylus goes at ten times the speed for a tenth of a second [s]."""
_AWAY, _SPEED = np.array([0.0, -1.0, 0.0]), 0.1
"""Where the hand goes that leaves the room, and how fast [m/s]: a second out, and one back."""
_ROUNDING = 1e-6
"""Share by which a limit may be passed: what the digits of the record leave."""
_STILL = np.array([1.0, 0.0, 0.0, 0.0])
"""A stylus that is not turned."""

_MISBEHAVIOUR: dict[str, Callable[[DeviceClient], object]] = {
    "silence": lambda client: None,
    "NaN": lambda client: client.servo_cp(np.full(3, np.nan), _STILL),
    "a jump of 10 m": lambda client: client.servo_cp(np.array([0.0, 10.0, 0.0]), _STILL),
}
"""Faults of a device that has led."""

Path6 = Callable[[float], tuple[FloatArray, FloatArray]]
"""Place [m] and orientation of the stylus at a time [s]."""


class _Answers(NamedTuple):
    """Answers that a device got."""

    taken: FloatArray
    """Time from each request to its reply [s]."""
    periods: FloatArray
    """Time from each pose to the next [s]."""
    forces: FloatArray
    """Force of each reply [N], shape (n, 3)."""
    distances: FloatArray
    """Distance of stylus and blade in it [m]."""
    state: DeviceState
    """The last reply."""

    @property
    def jump(self) -> float:
        """Largest change of the force from one answer to the next [N]."""
        return float(np.linalg.norm(np.diff(self.forces, axis=0), axis=1).max())

    @property
    def most_force(self) -> float:
        """Largest force of an answer [N]."""
        return float(np.linalg.norm(self.forces, axis=1).max())


def device_link(scene: str = "organ", /, *, seconds: float = 60.0) -> BenchmarkResult:
    """Time the link of a device that leads the blade, and count what passes a limit.

    A fake device in this process leads the blade of `scalpel-sim run --hand device` in another one,
    a thousand poses a second: to and fro through the body, in bends, with turns, and now and then
    faster than the blade may; then at 100 mm/s out of the room and back. In the record of the run
    no step of the blade may be faster than its limits. As the loop of a device does, it takes
    precedence over other programs where the system allows that.

    Args:
        scene: Scene.
        seconds: Wall time [s].
    """
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(1))
    with tempfile.TemporaryDirectory() as folder:
        command = ["run", scene, "--hand", "device", "--listen", "127.0.0.1:0", "--quiet"]
        run = subprocess.Popen(
            [sys.executable, "-m", "scalpel_sim", *command, "--out", folder],
            stderr=subprocess.PIPE,
            text=True,
            preexec_fn=_without_precedence,
        )
        assert run.stderr is not None
        address = next(line for line in run.stderr if "waiting for a device" in line).split()[-1]
        with DeviceClient(address, period=_PERIOD) as client:
            led = _lead(client, _to_and_fro, seconds)
            parted = _lead(client, _out_and_back, 2.5)
            limits = client.description
            rests = {name: _time_to_rest(client, act) for name, act in _MISBEHAVIOUR.items()}
            client.end()
        run.communicate()
        stroke = np.genfromtxt(Path(folder) / "stroke.csv", delimiter=",", names=True)
        cut_area = np.genfromtxt(Path(folder) / "forces.csv", delimiter=",", names=True)[
            "cut_area_m2"
        ][-1]
    speed, turn_rate = _fastest(stroke)
    bound = (1.0 + _ROUNDING) * MOST_HURRY
    passed = (speed > bound * limits.most_speed) + (turn_rate > bound * limits.most_turn_rate)
    rows = Rows("device-link")
    rows.times("request to reply", None, [led.taken])
    rows.times("pose to pose", None, [led.periods])
    for case, unit, value in (
        ("real-time factor", "", led.state.time / seconds),
        ("replies within 1 ms", "%", 100.0 * np.mean(led.taken < 1e-3)),
        ("slowest of a thousand", "ms", 1e3 * np.quantile(led.taken, 0.999)),
        ("largest jump of force", "N", led.jump),
        ("largest force", "N", led.most_force),
        ("at 100 mm/s: farthest apart", "mm", 1e3 * parted.distances.max()),
        ("back: apart", "mm", 1e3 * parted.distances[-1]),
        ("out and back: largest jump", "N", parted.jump),
        ("out and back: largest force", "N", parted.most_force),
        *((f"until rest after {name}", "ms", 1e3 * rest) for name, rest in rests.items()),
        (f"fastest, limit {MOST_HURRY * limits.most_speed:g}", "m/s", speed),
        (f"fastest turn, limit {MOST_HURRY * limits.most_turn_rate:g}", "rad/s", turn_rate),
        ("limits passed", "", passed),
        ("periods missed", "", led.state.n_missed),
        ("messages dropped", "", led.state.n_dropped),
        ("frames limited", "", led.state.n_limited),
        ("cut", "mm2", 1e6 * cut_area),
    ):
        clock = WALL.name if unit == "ms" else COUNTED
        rows.values(case, None, [float(value)], unit, clock=clock)
    about = (
        f"{len(led.taken):,} poses in {seconds:g} s, {led.state.time:.1f} s simulated. Load of the "
        f"machine at the end {os.getloadavg()[0]:.1f}, of this benchmark's own some 2."
    )
    return rows.table(scene, about)._replace(is_right=not passed)


def _without_precedence() -> None:
    """Run what follows as any other program."""
    with contextlib.suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))


def _to_and_fro(now: float) -> tuple[FloatArray, FloatArray]:
    """Return a pose of the stylus that draws the blade through the body."""
    n_spurts, since = divmod(now, _SPURT)
    in_spurt = max(since - (_SPURT - 0.1), 0.0)
    at = now + 9.0 * (0.1 * n_spurts + in_spurt)
    angle = 0.1 * math.sin(at)
    turned = np.array([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])
    return _REACH * np.sin(_RATES * at), turned


def _out_and_back(now: float) -> tuple[FloatArray, FloatArray]:
    """Return a pose of a stylus that leaves the room for a second, comes back, and rests."""
    return _SPEED * max(0.0, 1.0 - abs(now - 1.0)) * _AWAY, _STILL


def _lead(client: DeviceClient, path: Path6, seconds: float) -> _Answers:
    """Lead the blade along a path of the stylus for so many seconds."""
    taken, sent, forces, distances = [], [], [], []
    client.servo_cp(*path(0.0), holds=False)  # it takes hold where it is now
    start = due = time.monotonic()
    state = client.measured()
    while (now := time.monotonic()) - start < seconds:
        state = client.servo_cp(*path(now - start))
        taken.append(time.monotonic() - now)
        sent.append(now)
        forces.append(state.measured_cf.force)
        distances.append(state.stylus_distance)
        due = max(due + _PERIOD, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    return _Answers(np.array(taken), np.diff(sent), np.array(forces), np.array(distances), state)


def _time_to_rest(client: DeviceClient, misbehave: Callable[[DeviceClient], object]) -> float:
    """Return the wall time from the last good pose until nobody leads the blade [s]."""
    for k in range(100):
        client.servo_cp(np.array([0.0, 1e-5 * k, 0.0]), _STILL)
        time.sleep(_PERIOD)
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
