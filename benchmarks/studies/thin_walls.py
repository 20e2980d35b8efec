"""Random strokes through thin bodies, and how many leave two pieces and no fragment.

The bodies are half shells of 60 mm with walls of 3 to 8 mm and elements of half to the whole wall,
flat sheets of 6 mm, and bars whose every node lies on the skin. Each is of gel, held at its left
and right, and sags under gravity. A scalpel without an arm makes a straight, slanted or curved
stroke through it, at a random place, angle and speed. Variation i of a seed is always the same.
"""

import itertools
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from benchmarks.timing import TurnWatch
from scalpel_sim.scene.blade import SCALPEL
from scalpel_sim.scene.scene import GEL
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.strokes.scene_stroke import stroke_through
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.validate.speed.measurements import BenchmarkResult
from scalpel_sim.validate.speed.tables import compact_table
from scalpel_sim.validate.speed.watch import SILENT
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

if TYPE_CHECKING:
    from rich.console import Console

_DIAMETER = 0.06
"""Diameter of the shells, and edge of the sheets [m]."""
_WALLS = (3e-3, 8e-3)
"""Thinnest and thickest wall of a shell [m]."""
_SHEET = 6e-3
"""Thickness of the sheets [m]."""
_STROKES = ("straight", "slanted", "curved")
_PLACE = 0.1
"""Largest distance of a stroke from where it is planned, per width of the body."""
_YAW = 0.2
"""Largest angle by which a stroke is turned about the vertical [rad]."""
_SPEEDS = (0.03, 0.12)
"""Slowest and fastest blade [m/s]."""
_DT = 1e-3
"""Length of a frame [s]."""
_REST = 50
"""Frames after the blade has left."""
_LEAST_SHARE = 0.05
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


def thin_walls(
    *,
    watch: TurnWatch = SILENT,
    variations: int = 40,
    first: int = 0,
    seed: int = 0,
    only: Literal["shell", "sheet", "bar"] | None = None,
) -> BenchmarkResult:
    """Cut thin bodies at random: count the strokes that leave two pieces and no fragment.

    Args:
        watch: Receives the progress.
        variations: Number of variations.
        first: Number of the first variation.
        seed: Of the random numbers.
        only: Bodies of this kind alone.
    """
    tried: Counter[str] = Counter()
    right: Counter[str] = Counter()
    faults: list[str] = []
    watch.begin(variations)
    for number in range(first, first + variations):
        chosen = variation(number, seed)
        if only not in (None, chosen.kind):
            continue
        tried[chosen.kind] += 1
        try:
            fault = fault_of(chosen)
        except TissueError as error:
            fault = str(error)
        right[chosen.kind] += not fault
        if fault:
            faults.append(f"{chosen.title}: {fault}")
        watch.tick(chosen.title)

    def show(console: "Console") -> None:
        table = compact_table("two pieces and no fragment", ("body",), ("strokes", "right"))
        for kind in sorted(tried):
            table.add_row(kind, str(tried[kind]), str(right[kind]))
        table.add_row("all", str(tried.total()), str(right.total()))
        console.print(table)
        for line in faults:
            console.print(line, highlight=False)

    return BenchmarkResult([], [], show, is_right=not faults)


def variation(number: int, seed: int) -> Variation:
    """Return variation `number` of a seed: three of five are shells, one a sheet, one a bar."""
    from tests.support.bodies import half_shell

    random = np.random.default_rng((seed, number))
    wall, share = random.uniform(*_WALLS), random.uniform(0.5, 1.0)
    cells, width = int(random.integers(8, 21)), random.uniform(6e-3, 15e-3)
    kind = ("shell", "sheet", "shell", "bar", "shell")[number % 5]
    mesh: Callable[[], TetrahedralMesh]
    if kind == "shell":
        name = f"shell, wall {1e3 * wall:.2f} mm, elements {1e3 * share * wall:.2f} mm"
        mesh = partial(half_shell, wall, share * wall, _DIAMETER)
    elif kind == "sheet":
        layers = 1 + cells // 14
        name = f"sheet of {cells} x {cells} x {layers} cells"
        mesh = partial(block, (cells, cells, layers), (_DIAMETER, _DIAMETER, _SHEET))
    else:
        name = f"bar of {cells} x 1 x 1 cells, {1e3 * width:.1f} mm thick"
        mesh = partial(block, (cells, 1, 1), (_DIAMETER, width, width))
    return Variation(
        number=number,
        kind=kind,
        name=name,
        mesh=mesh,
        stroke=_STROKES[number // 5 % 3],
        place=random.uniform(-_PLACE, _PLACE),
        yaw=random.uniform(-_YAW, _YAW),
        speed=random.uniform(*_SPEEDS),
    )


def fault_of(chosen: Variation) -> str:
    """Make the stroke; return what is wrong after it, or nothing."""
    mesh = chosen.mesh()
    tissue = Tissue(mesh, GEL, fixed=fixed_nodes(mesh, "left,right"), blade=SCALPEL)
    tissue.settle()
    body = TetrahedralMesh(tissue.snapshot().positions, mesh.tetrahedra)
    low, high = body.positions.min(axis=0), body.positions.max(axis=0)
    row = StrokeTable(kind=chosen.stroke, speed=chosen.speed)
    stroke = stroke_through(body, [row], GEL)
    shift = chosen.place * (high - low)[0]
    edges = _poses(stroke, 0.5 * (low + high), shift, chosen.yaw)
    sweeps = [BladeSweep(*pair) for pair in itertools.pairwise(edges)]
    for sweep in (*sweeps, *[None] * _REST):
        result = tissue.step(sweep, _DT)
    volumes = np.array([piece.rest_volume for piece in tissue.pieces()])
    shares = volumes / volumes.sum()
    if len(shares) == 2 and shares.min() >= _LEAST_SHARE:
        return ""
    n_whole = int((shares >= _LEAST_SHARE).sum())
    parts = " + ".join(f"{1e2 * share:.3g}" for share in shares[:6])
    return (
        f"{'whole' if n_whole < 2 else 'in parts'}{' with fragments' * (n_whole < len(shares))}, "
        f"{parts} %, opened {1e6 * result.cut_area:.0f} mm2, paid "
        f"{1e6 * result.work_of_cutting / GEL.toughness:.0f}, {len(mesh.tetrahedra)} tetrahedra"
    )


def _poses(stroke: Stroke, centre: FloatArray, shift: float, yaw: float) -> list[BladeSegment]:
    """Return the pose in each frame of a stroke that is turned about `centre` and shifted [m]."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    offset = centre + np.array([shift, 0.0, 0.0])
    return [
        BladeSegment(
            turn @ (pose.tip - centre) + offset,
            turn @ (pose.heel - centre) + offset,
            turn @ pose.forward,
        )
        for pose in map(stroke.pose, np.arange(0.0, stroke.duration + _DT, _DT))
    ]
