"""`python -m tissue`: cut a block clean through, without an arm, and print the time per stage."""

import argparse
import sys
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tissue.boundary_conditions import fixed_nodes
from tissue.core.array_types import FloatArray
from tissue.core.three_vectors import BladeSegment, BladeSweep
from tissue.shapes.block import block
from tissue.tissue import Tissue
from tissue.types import StepResult, TetrahedralMesh, TissueError

_DT = 1e-3
"""Length of a frame [s]: 1 kHz, the rate of a haptic device."""

LEAN = 0.25
"""Sideways lean of the blade per height, so that it crosses tetrahedra in all orientations; upright
it could follow a plane of the grid."""

AHEAD = 0.1
"""Distance of the start of the blade from the front of the block, per depth of the block."""

_STAGES = {
    "CD": ("collision", "active tetrahedra, crossed edges"),
    "GC": ("topology", "insertion of nodes, separation"),
    "RX": ("relaxation", "forces, anchors, Runge-Kutta"),
}
"""The paper's names of the stages (Table 1)."""


class CutThrough(NamedTuple):
    """A body that was cut, and each frame of the cut."""

    tissue: Tissue
    """The body after the cut."""
    results: list[StepResult]
    """The result of each frame."""
    n_tetrahedra: int
    """Number of tetrahedra before the cut."""


def cut_through(mesh: TetrahedralMesh, steps: int) -> CutThrough:
    """Cut a body that is held at its left and right, from front to back.

    The blade passes the back of the body in `steps` frames. It continues at the same speed for at
    most as many again while it drags tissue along.
    """
    tissue = Tissue(mesh, fixed=fixed_nodes(mesh, "left,right"))
    before = tissue.n_tetrahedra
    low, high = tissue.bounds
    depth = (high - low)[1]
    advance = (1.0 + 2.0 * AHEAD) * depth / steps
    results: list[StepResult] = []
    for i in range(2 * steps):
        y = low[1] - AHEAD * depth + i * advance
        sweep = BladeSweep(_blade(low, high, y), _blade(low, high, y + advance))
        results.append(tissue.step(sweep, _DT))
        if i + 1 >= steps and results[-1].anchored_length == 0.0:
            break
    return CutThrough(tissue, results, before)


def _blade(low: FloatArray, high: FloatArray, y: float) -> BladeSegment:
    """Return an edge through the middle of the body, longer than it is high, that faces along y."""
    middle = 0.5 * (low + high)
    middle[1] = y
    half = 0.75 * (high - low)[2] * np.array([LEAN, 0.0, 1.0])
    return BladeSegment(middle - half, middle + half, np.array([0.0, 1.0, 0.0]))


def _report(cut: CutThrough) -> str:
    """Return a table: time per stage and frame, and the result of the cut."""
    results = cut.results
    times = {
        name: np.array([getattr(r.stage_times, f) for r in results])
        for name, (f, _) in _STAGES.items()
    }
    frame = np.sum(list(times.values()), axis=0)
    lines = [f"{'per frame [us]':<40}{'median':>10}{'99 %':>10}"]
    for name, (_, what) in _STAGES.items():
        lines.append(_row(f"{name}  {what}", times[name]))
    lines.append(_row("all", frame))
    in_contact = [np.linalg.norm(r.wrench.force) for r in results if r.anchored_length > 0.0]
    last = results[-1]
    facts = {
        "frames": f"{len(results)}",
        "frames per second": f"{_rate(np.median(frame))} median, "
        f"{_rate(np.percentile(frame, 99))} at the 99th percentile",
        "tetrahedra": f"{cut.n_tetrahedra} -> {last.n_tetrahedra}",
        "pieces": f"{cut.tissue.n_pieces()}",
        "cut area": f"{last.cut_area * 1e4:.4g} cm2",
        "mean force in contact": f"{np.mean(in_contact):.3g} N" if in_contact else "no contact",
    }
    return "\n".join(lines + [f"{name:<28}{value}" for name, value in facts.items()])


def _row(name: str, seconds: FloatArray) -> str:
    return f"{name:<40}{1e6 * np.median(seconds):>10.1f}{1e6 * np.percentile(seconds, 99):>10.1f}"


def _rate(seconds: float) -> str:
    return f"{1.0 / seconds:,.0f}" if seconds > 0.0 else "-"


def run_command(arguments: Sequence[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="python -m tissue", description=__doc__)
    parser.add_argument(
        "--cells",
        type=int,
        nargs=3,
        default=(4, 6, 4),
        metavar=("NX", "NY", "NZ"),
        help="cells of the block, six tetrahedra each (default: %(default)s)",
    )
    parser.add_argument(
        "--size",
        type=float,
        nargs=3,
        default=(0.04, 0.06, 0.04),
        metavar=("X", "Y", "Z"),
        help="edges of the block [m] (default: %(default)s)",
    )
    parser.add_argument(
        "--steps", type=int, default=400, help="frames of 1 ms that the cut takes (default: 400)"
    )
    options = parser.parse_args(arguments)
    if options.steps < 1:
        parser.error(f"--steps is {options.steps}; it must be at least 1")
    try:
        mesh = block(options.cells, options.size)
        cut_through(block((2, 2, 2)), 40)  # compiles, or loads what was compiled: not on the clock
        print(_report(cut_through(mesh, options.steps)))
    except ValueError as error:
        parser.error(str(error))
    except TissueError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(run_command())
