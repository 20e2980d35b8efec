"""The mesh that the command `mesh` has made, in figures and in lines to print."""

from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

_MM_PER_M = 1e3
_ML_PER_M3 = 1e6


class Meshed(NamedTuple):
    """A mesh, and what was done to get it."""

    mesh: "TetrahedralMesh"
    notes: tuple[str, ...]
    """Lines on all that was mended, closed, dropped or moved."""


SPECK = 0.01
"""Share of the volume of a mesh, below which a piece of it is left out: it would fall."""


def without_specks(mesh: "TetrahedralMesh") -> tuple["TetrahedralMesh", tuple[str, ...]]:
    """Return a mesh without its smallest pieces, and a line on them."""
    from tissue.support import components, signed_volumes

    edges = mesh.tetrahedra[:, [[0, 1], [0, 2], [0, 3]]].reshape(-1, 2)
    _, piece = components(len(mesh.positions), edges)
    of_tetrahedron = piece[mesh.tetrahedra[:, 0]]
    volumes = np.bincount(of_tetrahedron, signed_volumes(mesh.positions, mesh.tetrahedra))
    is_speck = volumes < SPECK * volumes.sum()
    if not is_speck.any():
        return mesh, ()
    kept = ~is_speck[of_tetrahedron]
    used, tetrahedra = np.unique(mesh.tetrahedra[kept], return_inverse=True)
    labels = None if mesh.labels is None else mesh.labels[kept]
    note = (
        f"left out {is_speck.sum()} pieces with {volumes[is_speck].sum() / volumes.sum():.2%} of "
        f"the volume, each less than {SPECK:.0%}"
    )
    whole = mesh._replace(
        positions=mesh.positions[used], tetrahedra=tetrahedra.reshape(-1, 4), labels=labels
    )
    return whole, (note,)


class MeshFigures(NamedTuple):
    """Numbers of a mesh."""

    n_tetrahedra: int
    n_nodes: int
    n_pieces: int
    """That share no node."""
    width: tuple[float, float, float]
    """Along x, y and z [m]."""
    volume: float
    """[m3]"""
    volumes: dict[str, float]
    """Of each label, by its number and name [m3]; empty without labels."""
    edge_length: float
    """In the mean [m]."""
    lowest_quality: float
    """1 for a regular tetrahedron, 0 for a flat one."""
    median_quality: float

    @classmethod
    def of(cls, mesh: "TetrahedralMesh") -> "MeshFigures":
        """Return those of a mesh."""
        from tissue.support import components, quality, signed_volumes

        volumes = signed_volumes(mesh.positions, mesh.tetrahedra)
        shape = quality(mesh.positions, mesh.tetrahedra)
        pairs = mesh.tetrahedra[:, [[0, 1], [0, 2], [0, 3], [1, 2], [1, 3], [2, 3]]]
        edges = np.unique(np.sort(pairs.reshape(-1, 2), axis=1), axis=0)
        ends = mesh.positions[edges]
        by_label = {}
        if mesh.labels is not None:
            for label in np.unique(mesh.labels).tolist():
                name = mesh.label_names.get(label)
                by_label[f"{label} ({name})" if name else str(label)] = float(
                    volumes[mesh.labels == label].sum()
                )
        return cls(
            n_tetrahedra=len(mesh.tetrahedra),
            n_nodes=len(mesh.positions),
            n_pieces=components(len(mesh.positions), edges)[0],
            width=tuple(np.ptp(mesh.positions, axis=0).tolist()),
            volume=float(volumes.sum()),
            volumes=by_label,
            edge_length=float(np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1).mean()),
            lowest_quality=float(shape.min()),
            median_quality=float(np.median(shape)),
        )


def lines_about(meshed: Meshed, figures: MeshFigures, out: Path) -> list[str]:
    """Return the lines that tell a user what was made, and what to do with it."""
    wide, deep, high = (f"{_MM_PER_M * side:.3g}" for side in figures.width)
    pieces = f" in {figures.n_pieces} pieces" if figures.n_pieces > 1 else ""
    lines = [
        f"{out}: {figures.n_tetrahedra:,} tetrahedra{pieces}, {figures.n_nodes:,} nodes, "
        f"{wide} x {deep} x {high} mm, {_ML_PER_M3 * figures.volume:.4g} ml",
        f"edges of {_MM_PER_M * figures.edge_length:.3g} mm in the mean; quality "
        f"{figures.lowest_quality:.2f} at least, {figures.median_quality:.2f} in the median "
        "(1: regular, 0: flat)",
    ]
    lines += [
        f"label {name}: {_ML_PER_M3 * volume:.4g} ml" for name, volume in figures.volumes.items()
    ]
    return [*lines, *meshed.notes, f"cut it with: scalpel-sim run --mesh {out}"]
