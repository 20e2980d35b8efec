"""Random strokes through thin bodies, and how many leave two pieces and no crumb.

Usage: PYTHONPATH=. python benchmarks/thin_walls.py [--variations N] [--seed N] [--only KIND]

The bodies are half shells of 60 mm with walls of 3 to 8 mm and elements of half to the whole wall,
flat sheets of 6 mm, and bars whose every node lies on the skin. Each is of gel, held at its left
and right, and sags under gravity. A scalpel without an arm makes a straight, slanted or curved
stroke through it, at a random place, angle and speed. A stroke is right if the body is then in two
pieces, each of a share of the body that no crumb has. The table counts them, and each stroke that
is not right has a line. Variation i of a seed is the same, however many there are.
"""

import argparse
import itertools
import sys
from collections import Counter
from collections.abc import Callable
from functools import partial
from time import perf_counter
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.table import Table

from scalpel_sim.scene.blade import SCALPEL
from scalpel_sim.scene.scene import GEL
from scalpel_sim.strokes.planning import plan_stroke
from scalpel_sim.strokes.stroke import Stroke
from tests.support import bodies
from tissue import (
    BladeSegment,
    BladeSweep,
    FloatArray,
    TetrahedralMesh,
    Tissue,
    TissueError,
    block,
    fixed_nodes,
)

DIAMETER = 0.06
"""Diameter of the shells, and edge of the sheets [m]."""
WALLS = (3e-3, 8e-3)
"""Thinnest and thickest wall of a shell [m]."""
SHEET = 6e-3
"""Thickness of the sheets [m]."""
STROKES = ("straight", "slanted", "curved")
PLACE = 0.1
"""Largest distance of a stroke from where it is planned, per width of the body."""
YAW = 0.2
"""Largest angle by which a stroke is turned about the vertical [rad]."""
SPEEDS = (0.03, 0.12)
"""Slowest and fastest blade [m/s]."""
DT = 1e-3
"""Length of a frame [s]."""
REST = 50
"""Frames after the blade has left."""
LEAST_SHARE = 0.05
"""Share of the volume that each of two halves has at least; strokes stay away from the sides."""


class Variation(NamedTuple):
    """A body and a stroke through it."""

    number: int
    kind: str
    name: str
    mesh: Callable[[], TetrahedralMesh]
    stroke: str
    place: float
    """Distance from where the stroke is planned, along x, per width of the body."""
    yaw: float
    """Angle by which the stroke is turned about the vertical [rad]."""
    speed: float
    """Speed of the blade [m/s]."""

    @property
    def title(self) -> str:
        """Everything that was drawn at random."""
        return (
            f"{self.number:4d} {self.name}, {self.stroke}, {self.place:+.3f}, {self.yaw:+.3f} rad,"
            f" {1e3 * self.speed:.0f} mm/s"
        )


class Outcome(NamedTuple):
    """What a stroke came to."""

    shares: list[float]
    """Share of the volume of each piece, the largest first."""
    cut: float
    """Area of the faces that were opened [m2]."""
    paid: float
    """Area that the blade paid for: work of cutting over toughness [m2]."""
    seconds: float
    n_tetrahedra: int

    @property
    def is_right(self) -> bool:
        """Whether the body is in two pieces, neither of them a crumb."""
        return len(self.shares) == 2 and min(self.shares) >= LEAST_SHARE

    @property
    def fault(self) -> str:
        """What is wrong: one piece, or pieces that are crumbs."""
        if self.is_right:
            return "right"
        whole = sum(share >= LEAST_SHARE for share in self.shares)
        crumbs = len(self.shares) - whole
        return ("whole" if whole < 2 else "in parts") + (" with crumbs" if crumbs else "")


def variation(number: int, seed: int) -> Variation:
    """Return variation `number` of a seed: three of five are shells, one a sheet, one a bar."""
    random = np.random.default_rng((seed, number))
    wall, share = random.uniform(*WALLS), random.uniform(0.5, 1.0)
    cells, width = int(random.integers(8, 21)), random.uniform(6e-3, 15e-3)
    kind = ("shell", "sheet", "shell", "bar", "shell")[number % 5]
    mesh: Callable[[], TetrahedralMesh]
    if kind == "shell":
        name = f"shell, wall {1e3 * wall:.2f} mm, elements {1e3 * share * wall:.2f} mm"
        mesh = partial(bodies.half_shell, wall, share * wall, DIAMETER)
    elif kind == "sheet":
        layers = 1 + cells // 14
        name = f"sheet of {cells} x {cells} x {layers} cells"
        mesh = partial(block, (cells, cells, layers), (DIAMETER, DIAMETER, SHEET))
    else:
        name = f"bar of {cells} x 1 x 1 cells, {1e3 * width:.1f} mm thick"
        mesh = partial(block, (cells, 1, 1), (DIAMETER, width, width))
    return Variation(
        number=number,
        kind=kind,
        name=name,
        mesh=mesh,
        stroke=STROKES[number // 5 % 3],
        place=random.uniform(-PLACE, PLACE),
        yaw=random.uniform(-YAW, YAW),
        speed=random.uniform(*SPEEDS),
    )


def poses(stroke: Stroke, centre: FloatArray, shift: float, yaw: float) -> list[BladeSegment]:
    """Return the pose in each frame of a stroke that is turned about `centre` and shifted [m]."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    offset = centre + np.array([shift, 0.0, 0.0])
    return [
        BladeSegment(
            turn @ (pose.tip - centre) + offset,
            turn @ (pose.heel - centre) + offset,
            turn @ pose.forward,
        )
        for pose in map(stroke.pose, np.arange(0.0, stroke.duration + DT, DT))
    ]


def run(chosen: Variation) -> Outcome:
    """Make the stroke."""
    began = perf_counter()
    mesh = chosen.mesh()
    tissue = Tissue(mesh, GEL, fixed=fixed_nodes(mesh, "left,right"), blade=SCALPEL)
    tissue.settle()
    body = TetrahedralMesh(tissue.snapshot().positions, mesh.tetrahedra)
    low, high = body.positions.min(axis=0), body.positions.max(axis=0)
    stroke = plan_stroke(chosen.stroke, body, speed=chosen.speed, material=GEL)
    shift = chosen.place * (high - low)[0]
    edges = poses(stroke, 0.5 * (low + high), shift, chosen.yaw)
    result = None
    for before, after in itertools.pairwise(edges):
        result = tissue.step(BladeSweep(before, after), DT)
    for _ in range(REST):
        result = tissue.step(None, DT)
    assert result is not None
    volumes = [piece.rest_volume for piece in tissue.pieces()]
    return Outcome(
        shares=[volume / sum(volumes) for volume in volumes],
        cut=result.cut_area,
        paid=result.work_of_cutting / GEL.toughness,
        seconds=perf_counter() - began,
        n_tetrahedra=len(mesh.tetrahedra),
    )


def main() -> int:
    """Run and print the counts; return 1 where a stroke is not right."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--variations", type=int, default=40)
    parser.add_argument("--first", type=int, default=0, help="number of the first variation")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", choices=("shell", "sheet", "bar"), default=None)
    options = parser.parse_args()
    tried: Counter[str] = Counter()
    right: Counter[str] = Counter()
    faults: list[str] = []
    for number in range(options.first, options.first + options.variations):
        chosen = variation(number, options.seed)
        if options.only not in (None, chosen.kind):
            continue
        try:
            outcome = run(chosen)
        except TissueError as error:
            faults.append(f"{chosen.title}: {error}")
            tried[chosen.kind] += 1
            continue
        tried[chosen.kind] += 1
        right[chosen.kind] += outcome.is_right
        shares = " + ".join(f"{1e2 * share:.3g}" for share in outcome.shares[:6])
        line = (
            f"{chosen.title}: {outcome.fault}, {shares} %, opened {1e6 * outcome.cut:.0f} mm2, paid"
            f" {1e6 * outcome.paid:.0f}"
        )
        print(
            f"{line}, {outcome.n_tetrahedra} tetrahedra, {outcome.seconds:.0f} s", file=sys.stderr
        )
        if not outcome.is_right:
            faults.append(line)
    table = Table("body", "strokes", "right", title="two pieces and no crumb")
    for kind in sorted(tried):
        table.add_row(kind, str(tried[kind]), str(right[kind]))
    table.add_row("all", str(tried.total()), str(right.total()))
    console = Console(width=150)
    console.print(table)
    for line in faults:
        console.print(line, highlight=False)
    return 1 if faults else 0


if __name__ == "__main__":
    sys.exit(main())
