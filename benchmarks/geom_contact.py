"""What contact with a table and two instruments adds to a frame of the organ.

Usage: PYTHONPATH=. python benchmarks/geom_contact.py [--frames N]

Two organs take their frames in turn: one lies on a table and is pressed by pads of two graspers,
whose shafts are above it; the other is alone. Both are kept from rest by a load of a micronewton.
The last line is the ratio of the medians of the later half of the frames.
"""

import argparse
import sys
import time

import numpy as np

from bridge import GeomPoses, TouchedGeoms
from scalpel_sim import SCENES
from scalpel_sim.preparation.tissue import make_tissue
from scalpel_sim.scene.scene import changed
from tissue import FloatArray, Geom, Tissue

DT = 1e-3
"""Length of a frame [s]."""

SINKING = 4e-5
"""How far the instruments go down in a frame [m]."""

LOWEST = 200
"""Frames after which they stay."""


def instruments(tissue: Tissue) -> tuple[list[Geom], FloatArray]:
    """Return a table, and pads and shafts of two graspers above a body, and where they are."""
    low, high = tissue.bounds
    x, y = (0.5 * (low + high))[:2]
    geoms, places = [Geom("table", "plane", (), 0.3)], [[0.0, 0.0, low[2] + 3e-4]]
    for name, at in (("left", x - 0.02), ("right", x + 0.02)):
        for side in (-1, 1):
            geoms.append(Geom(f"{name} pad {side}", "box", (0.002, 0.008, 0.004), 0.5))
            places.append([at + 0.012 * side, y, high[2] + 0.006])
            geoms.append(Geom(f"{name} shaft {side}", "capsule", (0.003, 0.03), 0.5))
            places.append([at + 0.012 * side, y, high[2] + 0.05])
    return geoms, np.array(places)


def main() -> int:
    """Do the frames and print what they took."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--frames", type=int, default=600)
    options = parser.parse_args()
    scene = changed(SCENES["organ"], table=None)
    alone, touched = make_tissue(scene), make_tissue(scene)
    for tissue in (alone, touched):
        tissue.push("top", (0.0, 0.0, -1e-6))
    geoms, places = instruments(touched)
    rotations = np.tile(np.eye(3), (len(geoms), 1, 1))
    contact = TouchedGeoms(touched, geoms, GeomPoses(places, rotations))
    seconds = np.zeros((2, options.frames))
    for k in range(options.frames):
        now = time.perf_counter()
        alone.step(None, DT)
        seconds[0, k] = time.perf_counter() - now
        origins = places.copy()
        origins[1:, 2] -= SINKING * min(k, LOWEST)
        now = time.perf_counter()
        contact.move(GeomPoses(origins, rotations))
        touched.step(None, DT)
        _ = contact.loads
        seconds[1, k] = time.perf_counter() - now
    before, after = np.median(seconds[:, options.frames // 2 :], axis=1)
    found = contact.forces()
    print(
        f"{len(found.geom)} contacts press, on {len(set(found.geom.tolist()))} of {len(geoms)} "
        f"geoms; frame {1e6 * before:.0f} us without, {1e6 * after:.0f} us with: ratio "
        f"{after / before:.2f}"
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
