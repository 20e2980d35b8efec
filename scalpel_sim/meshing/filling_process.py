"""The program of the process that reads a surface and fills it, by pytetwild.

It is a process of its own since readers and mesher meet whatever users have: a sheet ends fTetWild
by a signal, a cloud of triangles keeps it busy for hours.
"""

import importlib.util
import json
import sys
from pathlib import Path
from types import ModuleType
from typing import NamedTuple

import numpy as np

from scalpel_sim.meshing.limited_process import limit_memory, refusing
from scalpel_sim.meshing.sizes import chosen_sizes
from scalpel_sim.meshing.surface import read_surface, with_notes_on_holes

FILLED_MESH = "result.npz"

_LOG_PASSES = 2
"""Level of fTetWild's log with a line for each pass."""


class Request(NamedTuple):
    """A surface to fill, and how."""

    path: str
    """Of the file."""
    scale: float | None
    """Unit of the file in metres. None: metres, where that makes sense."""
    edge_length: float | None
    """Of the tetrahedra [m]. None: chosen by the size of the body."""
    tolerance: float | None
    """Farthest that the surface may move [m]. None: chosen by the size of the body."""
    coarsen: bool
    """Whether as few tetrahedra are made as the tolerance allows."""
    memory: float
    """Largest memory of the process [GB]."""


def fill_requested(folder: Path, request: Request) -> None:
    """Read the surface that a request names, fill it, and write the mesh to the folder."""
    limit_memory(request.memory)
    with refusing(folder):
        surface = with_notes_on_holes(read_surface(Path(request.path), request.scale))
        sizes = chosen_sizes(surface, request.edge_length, request.tolerance)
        _without_pyvista()
        from pytetwild.pytetwild import tetrahedralize

        positions, tetrahedra = tetrahedralize(
            surface.vertices,
            surface.triangles.astype(np.int32),
            edge_length_abs=sizes.edge_length,
            epsilon=sizes.tolerance / surface.size(),
            coarsen=request.coarsen,
            vtk_ordering=True,
            quiet=False,
            loglevel=_LOG_PASSES,
        )
        np.savez(
            folder / FILLED_MESH,
            positions=positions,
            tetrahedra=tetrahedra,
            vertices=surface.vertices,
            triangles=surface.triangles,
            notes=np.array(surface.notes, dtype=np.str_),
            sizes=np.array(sizes),
        )


def _without_pyvista() -> None:
    """Make pytetwild importable where PyVista, which it needs for its own meshes, is not installed.

    From 0.4 on it imports PyVista to register itself there, and does nothing with an older one.
    """
    if importlib.util.find_spec("pyvista") is None:
        sys.modules["pyvista"] = ModuleType("pyvista")


if __name__ == "__main__":
    fill_requested(Path(sys.argv[1]), Request(*json.loads(sys.argv[2])))
