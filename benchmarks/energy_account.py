"""Whether the account of the energy closes over many strokes into one body.

Usage: PYTHONPATH=. python benchmarks/energy_account.py [--strokes N] [--seed N]

The strokes are those of `random_strokes.py`, and loose pieces land on a floor. After each tenth a
row shows the terms of the account so far as shares of the work of the blade. The last line says
whether the residual is within 1 % of that work after each of these.
"""

import argparse
import itertools
import sys
from dataclasses import replace

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.random_stroke import STROKE_DT, STROKE_FLOOR, random_stroke
from scalpel_sim import SCENES
from scalpel_sim.scene_body import make_tissue
from tissue import BladeSweep, Energies

CLOSED = 0.01
"""Largest residual of an account that closes, as a share of the work of the blade."""
ROWS_EVERY = 10
"""Strokes from one row to the next."""


def shares(energies: Energies) -> list[float]:
    """Return the terms of an account and its residual as shares of the work of the blade."""
    return [term / energies.work_of_blade for term in (*energies[3:], energies.residual)]


def main() -> int:
    """Cut and print the account; return 1 where it does not close."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--strokes", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--relaxation", choices=("global", "verlet"), default="global")
    parser.add_argument("--contact", choices=("impulses", "penalty"), default=None)
    parser.add_argument("--law", choices=("springs", "neo_hookean"), default=None)
    options = parser.parse_args()
    scene = SCENES["organ"]
    material = scene.material
    if options.law:
        ratio = 0.45 if options.law == "neo_hookean" else 0.25
        material = replace(material, law=options.law, poisson_ratio=ratio)
    how = {"relaxation": options.relaxation, "audit": True}
    tissue = make_tissue(changed(scene, material=material, floor=STROKE_FLOOR, table=None, **how))
    random = np.random.default_rng(options.seed)
    table = Table(
        title=f"organ, law {material.law}, relaxation {options.relaxation}; % of the work"
    )
    for name in ("strokes", "work [mJ]", *Energies._fields[3:], "residual"):
        table.add_column(name, justify="right")
    largest = 0.0
    for i in range(1, options.strokes + 1):
        for before, after in itertools.pairwise(random_stroke(tissue, random)):
            tissue.step(BladeSweep(before, after), STROKE_DT)
        for _ in range(50):
            energies = tissue.step(None, STROKE_DT).energies
        assert energies is not None
        if i % ROWS_EVERY == 0 or i == options.strokes:
            found = shares(energies)
            largest = max(largest, abs(found[-1]))
            row = [f"{1e2 * share:.3f}" for share in found]
            table.add_row(str(i), f"{1e3 * energies.work_of_blade:.1f}", *row)
            print(i, *row, file=sys.stderr)
    console = Console(width=160)
    console.print(table)
    closes = largest <= CLOSED
    console.print(f"{'closes' if closes else 'DOES NOT CLOSE'}: within {1e2 * largest:.3f} %")
    return 0 if closes else 1


if __name__ == "__main__":
    sys.exit(main())
