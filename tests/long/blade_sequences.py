"""Random sequences of strokes of a blade, in a body that is held, hangs, lies or falls."""

from typing import Any

import numpy as np

from tests.long.cut_sequences import BODIES, Cut, Draw, body, drawn, kinds_of
from tests.support import bodies, incisions, soundness
from tests.support.strokes import DT, Stroke, pose, sweeps
from tissue import BladeSegment, BladeShape, Tissue

SMALL = [name for name in BODIES if len(body(name).tetrahedra) < 700]
"""Bodies of which a stroke takes some tenths of a second."""

SPEEDS = (0.3, 3.0)
"""Slowest and fastest blade [m/s]; a surgeon's is below 0.5, of which each stroke takes longer."""

AWAY = 3
"""Frames without a blade after each stroke: they end its incision."""

REST = 25
"""Frames for which an edge rests: longer than the time after which the cut opens up to it."""


def held(random: np.random.Generator, name: str) -> Tissue:
    """Return a body: on a floor or not, held at one side, at two, or not at all."""
    mesh = body(name)
    axis = int(random.integers(3))
    both = bodies.sides(mesh, axis, 0.08)
    left = mesh.positions[:, axis] < mesh.positions[:, axis].mean()
    fixed = [both, both & left, np.zeros_like(both)][random.choice(3, p=[0.4, 0.5, 0.1])]
    floor = float(mesh.positions[:, 2].min()) if random.random() < 0.5 else None
    gravity = (0.0, 0.0, -9.81) if fixed.any() or floor is not None else (0.0, 0.0, 0.0)
    blade = BladeShape() if random.random() < 0.3 else None
    return Tissue(mesh, fixed=fixed, floor=floor, gravity=gravity, blade=blade)


def stroke_of(random: np.random.Generator, cut: incisions.Incision) -> Stroke:
    """Return the stroke along a surface at a random speed, and what the hand does at its end."""
    speed = float(np.exp(random.uniform(*np.log(SPEEDS))))
    there = incisions.blade_on(cut, speed * DT)
    if len(there) < 2:
        return there * REST
    end = random.choice(["leave", "draw back", "rest", "turn", "tremble"])
    return (
        there
        + {
            "leave": lambda: [],
            "draw back": lambda: there[::-1],
            "rest": lambda: there[-1:] * REST,
            "turn": lambda: turned(there[-1], random.normal(0.0, 0.5)),
            "tremble": lambda: [
                there[-1 - i] for i in random.integers(0, min(5, len(there)), REST)
            ],
        }[end]()
    )


def turned(last: BladeSegment, angle: float) -> Stroke:
    """Return the poses of an edge that turns about its middle, in the plane of blade and path."""
    middle, half = 0.5 * (last.tip + last.heel), 0.5 * (last.heel - last.tip)
    across = np.cross(half, last.forward)
    across /= np.linalg.norm(across)
    poses = []
    for a in np.linspace(0.0, angle, REST):
        h, f = (np.cos(a) * v + np.sin(a) * np.cross(across, v) for v in (half, last.forward))
        poses.append(pose(middle - h, middle + h, f))
    return poses


def run(case: int) -> dict[str, Any]:
    """Make a sequence of strokes.

    Returns:
        `faults` of the body after the first stroke that left any, and `n_strokes`.
    """
    random = np.random.default_rng([case, 0])
    name = str(random.choice(SMALL))
    tissue = held(random, name)
    before = tissue.snapshot()
    earlier: list[Cut] = []
    for i, kind in enumerate(kinds_of(random)):
        pieces = tissue.pieces()
        loose = pieces[-1].centre if len(pieces) > 1 else None
        cut = drawn(kind, Draw(random, body(name), earlier, loose))
        earlier.append(cut)
        for sweep in sweeps(stroke_of(random, cut.incision)):
            tissue.step(sweep, DT)
        for _ in range(AWAY):
            tissue.step(None, DT)
        found = soundness.faults(before, tissue.snapshot(), mass=1e-9, lips_match=False)
        found += soundness.link_faults(tissue._body)
        if found:
            named = [f"in {name} after stroke {i}, {kind}: {fault}" for fault in found]
            return {"faults": named, "n_strokes": i + 1}
    return {"faults": [], "n_strokes": len(earlier)}
