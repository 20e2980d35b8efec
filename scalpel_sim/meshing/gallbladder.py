"""A gallbladder on its bed of liver: implicit shapes, and the meshes that come with the package.

`python -m scalpel_sim.meshing.gallbladder` makes the meshes again and writes their files.

It stands: x goes from the neck to the fundus, y from the gallbladder into the liver, z upwards.
The gallbladder is solid, in the place of a wall round bile. The artery is twice as thick as a real
one, which is 2 to 3 mm: a tetrahedron is 4 mm wide, and 7 mm in the coarse mesh.
"""

from pathlib import Path

import numpy as np

from scalpel_sim.meshing.local_repair import mended
from tissue import FloatArray, IntArray, TetrahedralMesh

GALLBLADDER_FILE = Path(__file__).with_name("gallbladder.npz")
"""The mesh that comes with the package."""

COARSE_FILE = Path(__file__).with_name("gallbladder_coarse.npz")
"""A coarse one, for policies that learn: a fifth of the tetrahedra."""

PART_NAMES = {1: "liver", 2: "fat", 3: "gallbladder", 4: "artery"}
"""Names of the labels."""

LATTICE_SPACING = 0.0047
"""Edge of a lattice cell [m]: gives some 4,800 tetrahedra."""

COARSE_SPACING = 0.0084
"""The same of the coarse mesh [m]: gives some 1,100."""

MENDED_QUALITY = 0.5
"""Quality to which tetrahedra are mended: small ones where three labels meet would make the time
step a third as long."""

MENDED_STEP = 0.0006
"""Farthest that a node of a surface is moved for that [m]."""

MIDDLE_HEIGHT = 0.02
"""Height of the middle of all above its lowest place [m]."""

LIVER_BACK = 0.0232
"""Distance of the back of the liver from the front of the gallbladder [m]."""


def bed_height(x: FloatArray, z: FloatArray) -> FloatArray:
    """Return how high the liver is above its back [m]: a hollow, and lower beside the gallbladder.

    Args:
        x: Places along the gallbladder [m].
        z: Heights above the middle [m].
    """
    beside = np.clip((np.abs(z) - 0.011) / 0.009, 0.0, 1.0)
    hollow = np.exp(-(((x - 0.037) / 0.018) ** 2))
    height: FloatArray = 0.0098 - 0.0012 * hollow - 0.0040 * beside**2
    return height


def depth_in_part(points: FloatArray, labels: IntArray) -> FloatArray:
    """Return how deep `points` [m], shape (n, 3), are in the parts of these labels [m]."""
    x, y, z = points.T
    z = z - MIDDLE_HEIGHT
    height = LIVER_BACK - y
    over = height - bed_height(x, z)
    sac, pad = _sac(x, height, z), _pad(x, height, z)
    vessel = np.minimum(0.0027 - np.hypot(x - 0.0085, height - 0.0150), 0.0105 - np.abs(z))
    slab = 0.012 * (1.0 - np.abs((x - 0.030) / 0.030) ** 5 - np.abs(z / 0.020) ** 5)
    depths = np.stack(
        [
            np.zeros(len(points)),
            np.minimum.reduce([slab, height, -over]),
            np.minimum.reduce([pad, over, -sac, -vessel]),
            np.minimum.reduce([sac, over, -vessel]),
            np.minimum(vessel, over),
        ]
    )
    depth: FloatArray = depths[labels, np.arange(len(points))]
    return depth


def _sac(x: FloatArray, height: FloatArray, z: FloatArray) -> FloatArray:
    """Return how deep places are in the gallbladder [m]: a pear that overhangs the liver."""
    along = (x - 0.041) / 0.032
    end = np.clip(along, -1.3, 1.3)
    width = 0.0115 * (1.0 + 0.28 * end - 0.10 * end**2)
    middle = 0.0130 + 0.001 * end
    across = (z / width) ** 2 + ((height - middle) / (0.82 * width)) ** 2
    depth: FloatArray = 0.0115 * (1.0 - np.abs(along) ** 2.6 - across)
    return depth


def _pad(x: FloatArray, height: FloatArray, z: FloatArray) -> FloatArray:
    """Return how deep places are in the fat round the neck, through which the artery comes [m]."""
    along, up, across = (x - 0.0135) / 0.0115, (height - 0.0125) / 0.0085, z / 0.014
    depth: FloatArray = 0.009 * (1.0 - along**2 - up**2 - across**2)
    return depth


def made_gallbladder(spacing: float = LATTICE_SPACING) -> TetrahedralMesh:
    """Return the mesh, its lowest corner at the origin.

    Args:
        spacing: Edge of a lattice cell [m].
    """
    from tissue.support import stuff_labels

    # The back and the middle lie in planes of the lattice.
    low = [-5.0 * spacing, LIVER_BACK - 7.0 * spacing, MIDDLE_HEIGHT - 6.0 * spacing]
    high = [0.095, LIVER_BACK + 3.0 * spacing, MIDDLE_HEIGHT + 6.0 * spacing]
    made = stuff_labels(depth_in_part, len(PART_NAMES), [low, high], spacing)
    mesh = mended(made, MENDED_QUALITY, MENDED_STEP).mesh
    return mesh._replace(
        positions=mesh.positions - mesh.positions.min(axis=0), label_names=dict(PART_NAMES)
    )


def gallbladder(*, coarse: bool = False) -> TetrahedralMesh:
    """Return a mesh that `made_gallbladder` made: 73 x 23 x 40 mm.

    Args:
        coarse: Whether it is the one in `COARSE_FILE`; else that in `GALLBLADDER_FILE`.
    """
    with np.load(COARSE_FILE if coarse else GALLBLADDER_FILE, allow_pickle=False) as file:
        return TetrahedralMesh(
            file["positions"],
            file["tetrahedra"].astype(np.int64),
            file["labels"].astype(np.int64),
            dict(PART_NAMES),
        )


def _save(mesh: TetrahedralMesh, path: Path) -> None:
    """Write the file of a mesh."""
    tetrahedra = mesh.tetrahedra.astype(np.int32)
    assert mesh.labels is not None
    labels = mesh.labels.astype(np.int8)
    np.savez_compressed(path, positions=mesh.positions, tetrahedra=tetrahedra, labels=labels)


if __name__ == "__main__":
    _save(made_gallbladder(), GALLBLADDER_FILE)
    _save(made_gallbladder(COARSE_SPACING), COARSE_FILE)
