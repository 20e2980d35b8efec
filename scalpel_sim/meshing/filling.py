"""Tetrahedra inside a surface, made in a process of its own."""

import importlib.util
import json
import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.meshing.filling_process import FILLED_MESH, Request
from scalpel_sim.meshing.limited_process import ProcessLimits, limited_process
from scalpel_sim.meshing.meshed import without_specks
from scalpel_sim.meshing.sizes import TOLERANCE_OF_SIZE, FillingSizes
from scalpel_sim.meshing.surface import FileSurface
from scalpel_sim.meshing.surface_distance import farthest_apart

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

_PASS = re.compile(r"/ pass (\d+) /")
"""A pass in fTetWild's log."""

_USUAL_PASSES = 80
"""Passes after which fTetWild ends by itself."""

MOST_ATTEMPTS = 3
"""Times that a surface is filled at most, so that it moves no farther than it may. The mesher keeps
the new surface near the old one, and not the old one near the new: sharp ridges are rounded."""

SHARE_OF_BOUND = 0.8
"""Way of the surface that the next attempt aims at, per its bound: how far it moves follows the
envelope of the mesher roughly."""

LEAST_OF_ENVELOPE = 0.2
"""Envelope of an attempt per that of the one before, at least: small ones take long."""


class Filled(NamedTuple):
    """Tetrahedra inside a surface."""

    mesh: "TetrahedralMesh"
    surface: FileSurface
    """The surface as it was read."""
    sizes: FillingSizes
    """The lengths that it was filled with."""
    bound: float
    """Farthest that the surface was to move [m]."""
    moved: float | None
    """Farthest that it moved: from the old one to the new one, or back [m]. None: there is no
    telling, as it has holes or faces either way."""

    def notes(self) -> tuple[str, ...]:
        """Return what was done, one line each."""
        if self.moved is None:
            most = 1e3 * self.sizes.tolerance
            way = f"the new surface is within {most:.2g} mm of that of the file"
        else:
            way = f"the surface moved by {1e3 * self.moved:.2g} mm at most"
            if self.moved > self.bound:
                way += (
                    f", more than {1e3 * self.bound:.2g} mm: ridges and gaps as narrow as that are "
                    "rounded; a smaller --tolerance keeps more of them"
                )
        return (*self.surface.notes, way)

    def is_kept(self) -> bool:
        """Return whether the surface moved no farther than it was to, as far as that is known."""
        return self.moved is None or self.moved <= self.bound


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
        tolerance: Farthest that the surface may move, either way [m]. None: half a percent of the
            body's size. Where it moves farther it is filled again, with a closer envelope.
        coarsen: Whether as few tetrahedra are made as the tolerance allows.
        limits: Time and memory.
        on_progress: Called with a line to show.

    Raises:
        UsageError: the file holds no body, its unit has to be given, or pytetwild is missing.
        RunError: the mesher crashed, or met a limit.
        MeshError: what it made is no sound mesh.
    """
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
    began, left, best = time.monotonic(), limits, None
    request = Request(str(path.absolute()), scale, edge_length, tolerance, coarsen, limits.memory)
    for _ in range(MOST_ATTEMPTS):
        try:
            made = _filled_once(path, request, tolerance, left, on_progress)
        except RunError:
            if best is None:
                raise
            break
        if best is None or (made.moved or 0.0) < (best.moved or 0.0):
            best = made
        if made.is_kept() or made.moved is None:
            break
        smaller = (
            max(LEAST_OF_ENVELOPE, SHARE_OF_BOUND * made.bound / made.moved) * made.sizes.tolerance
        )
        left = limits._replace(time=limits.time - (time.monotonic() - began))
        request = request._replace(tolerance=smaller, edge_length=made.sizes.edge_length)
    assert best is not None
    return best


def _filled_once(
    path: Path,
    request: Request,
    tolerance: float | None,
    limits: ProcessLimits,
    on_progress: Callable[[str], None],
) -> Filled:
    """Return tetrahedra inside a surface, and how far it moved.

    Args:
        path: The file of the surface.
        request: What is asked of the process.
        tolerance: What the user asked for [m]; that of the request may be less.
        limits: Time and memory that are left.
        on_progress: Called with a line to show.
    """
    from tissue import boundary_faces, mesh_from_arrays

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
    on_progress(f"measuring how far the surface of {path.name} moved")
    moved = None
    if surface.is_closed():
        skin = FileSurface(positions, boundary_faces(tetrahedra))
        moved = farthest_apart(surface, skin, sizes.tolerance)
    mesh, specks = without_specks(mesh_from_arrays(positions, tetrahedra))
    bound = tolerance or TOLERANCE_OF_SIZE * surface.size()
    return Filled(mesh, surface._replace(notes=(*surface.notes, *specks)), sizes, bound, moved)
