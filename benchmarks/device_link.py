"""Times the link of a device that leads the blade, and counts what passes a limit.

Usage: PYTHONPATH=. python benchmarks/device_link.py [SECONDS [SCENE]], on an idle machine

A fake device in this process leads the blade of `scalpel-sim run --hand device` in another one, a
thousand poses a second, for 60 s of wall time: to and fro through the body, in bends, with turns,
and now and then faster than the blade may. Then the record of the run is checked: no step of the
blade is faster than its limits. Printed are also the periods that the device missed, the time from
each request to its reply, and how soon the blade is let go when the device misbehaves.
"""

import contextlib
import math
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from bridge import DeviceClient, DeviceState, LinkError
from tissue import FloatArray

PERIOD = 1e-3
"""Period of the device [s]."""
SECONDS = 60.0
MILLISECONDS = 1e3
REACH = np.array([0.004, 0.03, 0.008])
"""Amplitude of the stylus along x, y and z [m]."""
RATES = np.array([1.3, 0.7, 2.1])
"""How fast it goes to and fro [rad/s]."""
SPURT = 10.0
"""Every so many seconds the stylus goes at ten times the speed for a tenth of a second [s]."""
RELATIVE_ROUNDING = 1e-6
"""By which a limit may be passed: what the digits of the record leave."""

STILL = np.array([1.0, 0.0, 0.0, 0.0])
"""A stylus that is not turned."""

MISBEHAVIOUR: dict[str, Callable[[DeviceClient], object]] = {
    "silence": lambda client: None,
    "NaN": lambda client: client.servo_cp(np.full(3, np.nan), STILL),
    "a jump of 10 m": lambda client: client.servo_cp(np.array([0.0, 10.0, 0.0]), STILL),
}
"""What a device may do that has led."""


def main() -> None:
    """Lead a run, and print what was measured."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    scene = sys.argv[2] if len(sys.argv) > 2 else "organ"
    with tempfile.TemporaryDirectory() as folder:
        command = ["run", scene, "--hand", "device", "--listen", "127.0.0.1:0", "--quiet"]
        run = subprocess.Popen(
            [sys.executable, "-m", "scalpel_sim", *command, "--out", folder],
            stderr=subprocess.PIPE,
            text=True,
        )
        assert run.stderr is not None
        address = next(line for line in run.stderr if "waiting for a device" in line).split()[-1]
        with DeviceClient(address, period=PERIOD) as client:
            taken, state = lead(client, seconds)
            limits = client.description
            rests = {name: time_to_rest(client, act) for name, act in MISBEHAVIOUR.items()}
            client.end()
        run.communicate()
        rows = np.genfromtxt(Path(folder) / "stroke.csv", delimiter=",", names=True)
        forces = np.genfromtxt(Path(folder) / "forces.csv", delimiter=",", names=True)
    speed, turn_rate = fastest(rows)
    force = np.sqrt(sum(forces[f"force_{axis}_n"] ** 2 for axis in "xyz")).max()
    median, p99, most = MILLISECONDS * np.percentile(taken, [50, 99, 100])
    print(f"{scene}: {len(taken):,} poses in {seconds:g} s, {state.time:.1f} s simulated")
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")
    print(f"fastest: {speed:.4f} of {limits.most_speed:g} m/s, ", end="")
    print(
        f"{turn_rate:.3f} of {limits.most_turn_rate:g} rad/s; largest force {force:.2f} N, "
        f"cut {1e6 * forces['cut_area_m2'][-1]:.0f} mm2"
    )
    within = 1.0 + RELATIVE_ROUNDING
    passed = (speed > within * limits.most_speed) + (turn_rate > within * limits.most_turn_rate)
    print(f"limits passed: {passed}")
    print(f"periods missed: {state.n_missed}, messages dropped: {state.n_dropped}, ", end="")
    print(f"frames limited: {state.n_limited}")
    for name, rest in rests.items():
        print(f"{name}: the blade is let go within {MILLISECONDS * rest:.0f} ms")
    print(f"request to reply: median {median:.2f} ms, p99 {p99:.2f} ms, longest {most:.0f} ms")


def lead(client: DeviceClient, seconds: float) -> tuple[FloatArray, DeviceState]:
    """Lead for so many seconds, and return the time of each reply [s], and the last state."""
    state = client.measured()
    taken, start = [], time.monotonic()
    due, stylus, before = start, 0.0, start
    while (now := time.monotonic()) - start < seconds:
        is_spurt = (now - start) % SPURT > SPURT - 0.1
        stylus += (10.0 if is_spurt else 1.0) * (now - before)
        before = now
        position = REACH * np.sin(RATES * stylus)
        angle = 0.1 * math.sin(stylus)
        orientation = np.array([math.cos(0.5 * angle), 0.0, 0.0, math.sin(0.5 * angle)])
        state = client.servo_cp(position, orientation)
        taken.append(time.monotonic() - now)
        due = max(due + PERIOD, time.monotonic())
        time.sleep(max(0.0, due - time.monotonic()))
    return np.array(taken), state


def time_to_rest(client: DeviceClient, misbehave: Callable[[DeviceClient], object]) -> float:
    """Return the wall time from the last good pose until nobody leads the blade [s]."""
    for k in range(100):
        client.servo_cp(np.array([0.0, 1e-5 * k, 0.0]), STILL)
    last = time.monotonic()
    with contextlib.suppress(LinkError):
        misbehave(client)
    while client.measured().is_engaged:
        pass
    return time.monotonic() - last


def fastest(rows: FloatArray) -> tuple[float, float]:
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


if __name__ == "__main__":
    main()
