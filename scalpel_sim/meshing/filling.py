"""Tetrahedra inside a surface, made in a process of its own."""

import importlib.util
import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.meshing.filling_process import FILLED_MESH, Request
from scalpel_sim.meshing.limited_process import ProcessLimits, limited_process
from scalpel_sim.meshing.meshed import without_specks
from scalpel_sim.meshing.sizes import FillingSizes
from scalpel_sim.meshing.surface import FileSurface

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

_PASS = re.compile(r"/ pass (\d+) /")
"""A pass in fTetWild's log."""

_USUAL_PASSES = 80
"""Passes after which fTetWild ends by itself."""


class Filled(NamedTuple):
    """Tetrahedra inside a surface."""

    mesh: "TetrahedralMesh"
    surface: FileSurface
    """The surface as it was read."""
    sizes: FillingSizes
    """The lengths that it was filled with."""

    def notes(self) -> tuple[str, ...]:
        """Return what was done, one line each."""
        # One way alone: a ridge of the file may be rounded by more.
        bound = f"the new surface is within {1e3 * self.sizes.tolerance:.2g} mm of that of the file"
        return (*self.surface.notes, bound)


def fill(
    path: Path,
    *,
    scale: float | None = None,
    edge_length: float | None = None,
    tolerance: float | None = None,
    coarsen: bool = False,
    limits: ProcessLimits = ProcessLimits(),
    on_progress: Callable[[str], None] = lambda text: None,
) -> Filled:
    """Return tetrahedra inside the surface in a file.

    Holes are closed, and parts that overlap are one body. The mesh of a file is not the same to the
    bit each time, on one thread too.

    Args:
        path: The file of the surface.
        scale: Its unit in metres. None: metres, where that makes sense.
        edge_length: Of the tetrahedra [m]. None: so that the mesh has some 5,000.
        tolerance: Farthest that the surface may move [m]. None: half a percent of the body's size,
            less where it is thin.
        coarsen: Whether as few tetrahedra are made as the tolerance allows.
        limits: Time and memory.
        on_progress: Called with a line to show.

    Raises:
        UsageError: the file holds no body, its unit has to be given, or pytetwild is missing.
        RunError: the mesher crashed, or met a limit.
        MeshError: what it made is no sound mesh.
    """
    from tissue import mesh_from_arrays

    if importlib.util.find_spec("pytetwild") is None:
        raise UsageError(
            "to fill a surface pytetwild is needed: install the extra `mesh`, "
            "pip install 'scalpel-sim[mesh]'"
        )
    for name, length in (("--edge-length", edge_length), ("--tolerance", tolerance)):
        if length is not None and not 0.0 < length < np.inf:
            raise UsageError(f"{name} is {length:g} m; it must be positive")
    if not path.is_file():
        raise UsageError(f"{path}: {'this is no file' if path.exists() else 'no such file'}")
    request = Request(str(path.absolute()), scale, edge_length, tolerance, coarsen, limits.memory)

    def show(log: str, passed: float) -> None:
        passes = _PASS.findall(log)
        step = f"pass {passes[-1]} of at most {_USUAL_PASSES}, " if passes else ""
        on_progress(f"filling {path.name}: {step}{passed:.0f} s of at most {limits.time:g} s")

    module = "scalpel_sim.meshing.filling_process"
    what = f"filling {path}"
    with (
        limited_process(module, [json.dumps(request)], what, limits, show) as folder,
        np.load(folder / FILLED_MESH, allow_pickle=False) as result,
    ):
        notes = tuple(result["notes"].tolist())
        surface = FileSurface(result["vertices"], result["triangles"], notes)
        positions, tetrahedra = result["positions"], result["tetrahedra"].astype(np.int64)
        sizes = FillingSizes(*result["sizes"].tolist())
    if not len(tetrahedra):
        raise RunError(
            f"{path}: no tetrahedron fits in: the body is thinner than the tolerance of "
            f"{sizes.tolerance * 1e3:.2g} mm; give a smaller --tolerance"
        )
    mesh, specks = without_specks(mesh_from_arrays(positions, tetrahedra))
    return Filled(mesh, surface._replace(notes=(*surface.notes, *specks)), sizes)
