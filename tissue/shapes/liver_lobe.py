"""A lobe of a liver, as an implicit shape and as the mesh that comes with the package.

`python -m tissue.shapes.liver_lobe` makes the mesh again and writes `MESH_FILE`.
"""

from pathlib import Path

import numpy as np

from tissue.core.array_types import FloatArray
from tissue.shapes.isosurface_stuffing import stuff
from tissue.types import TetrahedralMesh

MESH_FILE = Path(__file__).with_name("liver_lobe.npz")
"""The mesh that comes with the package."""

HALF_LENGTH = 0.045
"""Length from the middle to the ends, along x [m]."""
HALF_WIDTH = 0.029
"""Width from the middle to the front and the back, along y [m]."""
HALF_HEIGHT = 0.0163
"""Height from the middle to the top and the bottom, along z [m]."""

SPACING = 0.0063
"""Edge of a lattice cell [m]: gives some 5,000 tetrahedra, and five across the height."""


def inside_lobe(points: FloatArray) -> FloatArray:
    """Return how deep `points` [m], shape (n, 3), are inside the lobe: 1 to 0, negative outside.

    A flat egg: high and wide at the left, tapering to the right, thick along the back and thin
    along the front, domed above and hollow below, with the notch between two lobes in its front.
    """
    u, v, w = (points / (HALF_LENGTH, HALF_WIDTH, HALF_HEIGHT)).T
    inside_length = np.clip(u, -1.1, 1.1)
    width = 1.0 - 0.24 * inside_length - 0.08 * inside_length**2
    height = (1.0 - 0.28 * inside_length) * (1.0 + 0.22 * np.clip(v, -1.1, 1.1))
    notch = 0.9 * np.exp(-(((u - 0.46) / 0.15) ** 2) - ((v + 1.0) / 0.5) ** 2)
    hollow = 0.3 * np.exp(-((u / 0.55) ** 2) - (v / 0.6) ** 2)
    raised = w / height - hollow * (w < 0.0) * np.minimum(1.0, -w)
    depth: FloatArray = 1.0 - np.abs(u) ** 2.8 - np.abs(v / width) ** 2.3 - raised**2 - notch
    return depth


def make_mesh(spacing: float = 1.0) -> TetrahedralMesh:
    """Return a mesh of the lobe, its lowest corner at the origin; `spacing`: of `liver_lobe`."""
    half = 1.25 * np.array([HALF_LENGTH, HALF_WIDTH, HALF_HEIGHT])
    mesh = stuff(inside_lobe, [-half, half], spacing * SPACING)
    return TetrahedralMesh(mesh.positions - mesh.positions.min(axis=0), mesh.tetrahedra)


def liver_lobe(spacing: float = 1.0) -> TetrahedralMesh:
    """Return a lobe of a liver, its lowest corner at the origin: 90 x 61 x 34 mm, 5,136 tetrahedra.

    Args:
        spacing: Edge of the cells that it is filled with, per that of this mesh: 0.75 makes 11,708
            tetrahedra. At 1 the mesh is read from `MESH_FILE`, which `make_mesh` made.

    Raises:
        ValueError: the spacing is not positive, or so small that the mesh would not fit in memory.
    """
    if spacing != 1.0:
        return make_mesh(spacing)
    with np.load(MESH_FILE, allow_pickle=False) as file:
        return TetrahedralMesh(file["positions"], file["tetrahedra"].astype(np.int64))


def _save(mesh: TetrahedralMesh) -> None:
    """Write `MESH_FILE`."""
    tetrahedra = mesh.tetrahedra.astype(np.int32)
    np.savez_compressed(MESH_FILE, positions=mesh.positions, tetrahedra=tetrahedra)


if __name__ == "__main__":
    _save(make_mesh())
