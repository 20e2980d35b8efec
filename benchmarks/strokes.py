"""Random strokes across the organ, and whether its motion stays stable.

Usage: PYTHONPATH=. python benchmarks/random_strokes.py [--strokes N] [--seed N] [--overlaps]

Each stroke crosses the organ at a random position, direction, lean, depth and speed, at steps of
1 ms with default settings; loose pieces land on a floor. The table shows the body and its motion
after each stroke. The last line says whether the run stayed stable: every number finite, no node
much faster than the blade, and all at rest again within a second of the last stroke. With
`--overlaps` it is then also looked how deep the faces of cuts lie in other parts of the body.
"""

import argparse
import itertools
import sys
from dataclasses import replace
from time import thread_time

import numpy as np
from overlaps import report
from rich.console import Console
from rich.table import Table

from benchmarks.random_stroke import STROKE_DT, STROKE_FLOOR, random_stroke
from scalpel_sim import SCENES
from scalpel_sim.scene_body import make_tissue
from tissue import BladeSweep, Tissue, TissueError

FASTEST = 5.0
"""Speed of a node above which the motion counts as unstable [m/s]; the blade moves at 0.3."""
AT_REST = 0.02
"""Speed below which the body counts as at rest [m/s]."""


def fastest(tissue: Tissue) -> float:
    """Return the largest speed of a node [m/s]."""
    return float(np.linalg.norm(tissue.snapshot().velocities, axis=1).max())


def main() -> int:
    """Cut and print the outcome; return 1 where the run was not stable."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strokes", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--relaxation", choices=("global", "verlet", "hierarchical"), default=None)
    parser.add_argument("--contact", choices=("impulses", "penalty"), default=None)
    parser.add_argument("--law", choices=("springs", "neo_hookean"), default=None)
    parser.add_argument("--overlaps", action="store_true")
    options = parser.parse_args()
    scene = SCENES["organ"]
    material = scene.material
    if options.law:
        ratio = 0.45 if options.law == "neo_hookean" else 0.25
        material = replace(material, law=options.law, poisson_ratio=ratio)
    relaxation = options.relaxation or scene.solver.relaxation
    contact = options.contact
    scene = changed(scene, material=material, relaxation=relaxation)
    tissue = make_tissue(changed(scene, floor=STROKE_FLOOR, table=None))
    random = np.random.default_rng(options.seed)
    how = f"relaxation {relaxation}, contact {contact or 'by default'}"
    table = Table(title=f"organ, law {material.law}, {how}")
    names = ("stroke", "tetrahedra", "pieces", "substeps/ms", "contacts")
    for name in (*names, "CPU ms/ms", "fastest [m/s]"):
        table.add_column(name, justify="right")
    console = Console()
    is_stable, largest_speed = True, 0.0
    try:
        for i in range(options.strokes):
            substeps, began, n = 0, thread_time(), 0
            edges = random_stroke(tissue, random)
            for before, after in itertools.pairwise(edges):
                result = tissue.step(BladeSweep(before, after), STROKE_DT)
                substeps, n = max(substeps, result.n_substeps), n + 1
                if n % 20 == 0:
                    largest_speed = max(largest_speed, fastest(tissue))
            for _ in range(50):
                result = tissue.step(None, STROKE_DT)
            pressed = result.body_contacts.n_contacts
            row = (i + 1, tissue.n_tetrahedra, tissue.n_pieces(), substeps, pressed)
            spent = (thread_time() - began) / (n + 50) / STROKE_DT
            table.add_row(*map(str, row), f"{spent:.2f}", f"{largest_speed:.2f}")
            print(*row, f"{spent:.2f} {largest_speed:.2f}", file=sys.stderr)
        for _ in range(1000):
            tissue.step(None, STROKE_DT)
        is_stable = largest_speed < FASTEST and fastest(tissue) < AT_REST
    except TissueError as error:
        console.print(f"[red]{error}[/red]")
        is_stable = False
    console.print(table)
    final_speed = fastest(tissue)
    console.print(
        f"{'stable' if is_stable else 'NOT STABLE'}; fastest node at the end {final_speed:.4f} m/s"
    )
    if options.overlaps:
        report(tissue)
    return 0 if is_stable else 1


if __name__ == "__main__":
    sys.exit(main())
