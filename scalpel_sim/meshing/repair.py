"""A tetrahedral mesh that cannot be cut as it is becomes one that can."""

import contextlib
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.meshing.distinct import distinct
from scalpel_sim.meshing.filling import Filled, fill
from scalpel_sim.meshing.limited_process import ProcessLimits
from scalpel_sim.meshing.mended_mesh import REPAIRED_QUALITY, mended_mesh
from scalpel_sim.meshing.meshed import Meshed
from scalpel_sim.meshing.old_labels import with_old_labels
from scalpel_sim.meshing.sizes import edge_for
from scalpel_sim.meshing.units import scale_of

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

SAME_NODE = 1e-7
"""Distance per size of the body below which two nodes are one."""

MOST_BAD = 0.2
"""Share of bad tetrahedra up to which they are mended one by one, some 400 a second. Where more are
bad the whole is filled anew, which is faster, and better."""


def repaired(
    path: Path,
    *,
    scale: float | None = None,
    edge_length: float | None = None,
    tolerance: float | None = None,
    coarsen: bool = False,
    limits: ProcessLimits = ProcessLimits(),
    on_progress: Callable[[str], None] = lambda text: None,
) -> Meshed:
    """Return a tetrahedral mesh of a file, with a quality of `REPAIRED_QUALITY` at least.

    Nodes in the same place are merged, and bad tetrahedra are mended where they are. Where they are
    many, or that does not suffice, the skin is filled anew; labels are those of the old tetrahedra
    in the same places.

    Args:
        path: The file, of a kind that `tissue.read_mesh` reads.
        scale: Its unit in metres. None: metres, where that makes sense.
        edge_length: Of tetrahedra of a skin that is filled anew [m]. None: as those of the file.
            Given, the skin is always filled anew.
        tolerance: Farthest that the skin may move then [m]. None: half a percent of the size.
        coarsen: Whether it is filled with as few tetrahedra as the tolerance allows.
        limits: Of the process that fills it.
        on_progress: Called with a line to show.

    Raises:
        UsageError: the file holds no mesh, or its unit has to be given.
        RunError: the mesher crashed, or met a limit.
        MeshError: the mesh is broken, and could not be repaired.
    """
    from tissue import MeshError
    from tissue.support import quality, read_mesh_file

    on_progress(f"reading {path.name}")
    found = read_mesh_file(path)
    used = found.mesh.positions[np.unique(found.mesh.tetrahedra)]
    if not np.isfinite(used).all():
        raise UsageError(f"{path}: nodes of its tetrahedra have coordinates that are no numbers")
    unit = scale_of(path, float(np.ptp(used, axis=0).max()), scale)
    mesh = found.mesh._replace(positions=unit * found.mesh.positions)
    size = float(np.linalg.norm(np.ptp(unit * used, axis=0)))
    mesh, notes = distinct(mesh, SAME_NODE * size)
    shape = quality(mesh.positions, mesh.tetrahedra)
    notes += [
        *found.remarks,
        f"quality was {shape.min():.2g} at least, {np.median(shape):.2f} median",
    ]
    is_bad = shape < REPAIRED_QUALITY
    if edge_length is None and not coarsen and is_bad.mean() <= MOST_BAD:
        on_progress(f"mending {int(is_bad.sum())} tetrahedra")
        with contextlib.suppress(MeshError):
            made = mended_mesh(mesh, size)
            if quality(made.mesh.positions, made.mesh.tetrahedra).min() >= REPAIRED_QUALITY:
                return Meshed(made.mesh, (*notes, *made.notes))
    length = edge_length or edge_for(_mean_volume(mesh))
    return _filled_anew(
        mesh,
        tuple(notes),
        lambda skin: fill(
            skin,
            scale=1.0,
            edge_length=length,
            tolerance=tolerance,
            coarsen=coarsen,
            limits=limits,
            on_progress=on_progress,
        ),
    )


def _mean_volume(mesh: "TetrahedralMesh") -> float:
    """Return the mean volume of tetrahedra [m3]."""
    from tissue.support import signed_volumes

    return float(np.abs(signed_volumes(mesh.positions, mesh.tetrahedra)).mean())


def _filled_anew(
    mesh: "TetrahedralMesh", notes: tuple[str, ...], filled: Callable[[Path], Filled]
) -> Meshed:
    """Return a mesh inside the skin of another."""
    import trimesh

    from tissue import boundary_faces

    with tempfile.TemporaryDirectory(prefix="scalpel-sim-skin-") as folder:
        skin = trimesh.Trimesh(mesh.positions, boundary_faces(mesh.tetrahedra), process=False)
        skin.remove_unreferenced_vertices()
        skin.export(Path(folder) / "skin.obj", digits=12)
        made = filled(Path(folder) / "skin.obj")
    new, taken = with_old_labels(made.mesh, mesh)
    return Meshed(new, (*notes, "filled the skin anew", *made.notes(), *taken))
