"""A mesh mended in places, checked, and what to say of it."""

from typing import TYPE_CHECKING

from scalpel_sim.meshing.local_repair import mended
from scalpel_sim.meshing.meshed import Meshed, without_specks

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

REPAIRED_QUALITY = 0.1
"""Smallest quality of a mesh that was repaired: a good one of ordinary meshers has that."""

QUALITY_MARGIN = 1.5
"""Where one is below `REPAIRED_QUALITY`, all below so many times that are mended: neighbours are in
the way of the worst."""

SURFACE_STEP = 0.003
"""Farthest that one local operation moves the surface, per size of the body."""

MOST_OPERATIONS = 3
"""Kinds of local operations that move a place of the surface: together by less than a percent."""

_MM_PER_M = 1e3


def mended_mesh(mesh: "TetrahedralMesh", size: float) -> Meshed:
    """Return a mesh mended where its quality is below `REPAIRED_QUALITY`, and lines on that.

    Args:
        mesh: The mesh.
        size: Diagonal of the box around it [m].

    Raises:
        MeshError: it is broken, and stays so.
    """
    from tissue import mesh_from_arrays
    from tissue.support import quality

    lowest = quality(mesh.positions, mesh.tetrahedra).min()
    local = mended(
        mesh,
        QUALITY_MARGIN * REPAIRED_QUALITY if lowest < REPAIRED_QUALITY else REPAIRED_QUALITY,
        SURFACE_STEP * size,
    )
    done = ", ".join(f"{n} {what}" for what, n in local.counts.items() if n)
    now = local.mesh
    whole = mesh_from_arrays(now.positions, now.tetrahedra, now.labels, label_names=now.label_names)
    whole, specks = without_specks(whole)
    if not done:
        return Meshed(whole, specks)
    bound = MOST_OPERATIONS * local.bound
    moved = f"the surface moved by at most {_MM_PER_M * bound:.2g} mm" if bound else ""
    note = f"mended from a quality of {lowest:.2g}: {done}"
    return Meshed(whole, (*(each for each in (note, moved) if each), *specks))
