"""A specimen of each material by name: its size and support, and how fast it is cut with what.

A specimen follows an experiment that measured cutting, as far as the text that was read says how it
was done; docs/materials.md has which. It is cut clean through, so that the area is known.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from tissue import TetrahedralMesh, block


class Specimen(NamedTuple):
    """A block of cells, fine where it is cut, and how it is cut in two."""

    about: str
    """A description in one line."""
    along: Sequence[float]
    """Sizes of the cells along x [m], from low to high."""
    across: Sequence[float]
    """Sizes of the cells along y [m]."""
    layers: Sequence[float]
    """Sizes of the cells along z [m]."""
    fixed: str = "bottom"
    """What is held."""
    stretch: float = 0.0
    """How far opposite held sides are pulled apart, as a fraction."""
    speed: float = 0.06
    """Speed of the blade [m/s]."""
    arm: str = "auto"
    """The arm that cuts it: `auto`, or one by name."""
    has_scalpel: bool = True
    """Whether it is cut with a scalpel; if not, with a line, as thin as a wire can be."""

    def mesh(self) -> TetrahedralMesh:
        """Return the mesh of the block, with a corner at the origin."""
        ends = [
            np.append(0.0, np.cumsum(sizes)) for sizes in (self.along, self.across, self.layers)
        ]
        mesh = block(
            (len(self.along), len(self.across), len(self.layers)),
            (float(len(self.along)), float(len(self.across)), float(len(self.layers))),
        )
        places = [
            np.interp(mesh.positions[:, axis], np.arange(len(at)), at)
            for axis, at in enumerate(ends)
        ]
        return TetrahedralMesh(np.stack(places, axis=1), mesh.tetrahedra)


def _symmetric(middle: float, *outwards: float) -> list[float]:
    """Return sizes of cells on both sides of one in the middle [m]."""
    return [*outwards[::-1], middle, *outwards]


def _block(name: str) -> Specimen:
    """Return a block of 60 x 40 x 12 mm on a plate."""
    return Specimen(
        f"a block of {name}, 60 x 40 x 12 mm, on a plate; a scalpel cuts it in two: 480 mm²",
        _symmetric(4e-3, 5e-3, 6e-3, 7e-3, 10e-3),
        8 * [5e-3],
        3 * [4e-3],
    )


SPECIMENS = {
    "liver": Specimen(
        "a piece of liver, 150 x 80 x 20 mm, on a plate; a scalpel cuts it in two: 1,600 mm²",
        _symmetric(5e-3, 6e-3, 8e-3, 12e-3, 18e-3, 28.5e-3),
        16 * [5e-3],
        4 * [5e-3],
    ),
    "kidney": _block("kidney cortex"),
    "skin": Specimen(
        "a sheet of skin, 50 x 40 x 2 mm, stretched between two sides; a scalpel cuts it in two: "
        "80 mm²",
        _symmetric(4e-3, 4e-3, 5e-3, 6e-3, 8e-3),
        10 * [4e-3],
        (2e-3,),
        fixed="left,right",
        stretch=0.05,
        arm="premium",  # the smaller arm renders 3.3 N, and the peaks are 4 N
    ),
    "fat": _block("fat"),
    "muscle": _block("muscle"),
    "gelatin": Specimen(
        "a block of gelatin, 40 x 20 x 30 mm, on a plate; a thin wire cuts it in two at "
        "1,000 mm/min: 600 mm²",
        _symmetric(4e-3, *3 * [6e-3]),
        5 * [4e-3],
        6 * [5e-3],
        speed=1.0 / 60.0,
        has_scalpel=False,
    ),
    "silicone": _block("silicone"),
}
"""The specimens, by the name of their material."""
