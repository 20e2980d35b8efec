"""Writes the body of each step: its mesh where that changed, positions, fields, and its surface."""

from pathlib import Path

import numpy as np
import numpy.typing as npt

from bridge import TissueLink
from scalpel_sim.saved_run.cut_times import CutTimes
from scalpel_sim.saved_run.growing_tables import GrowingTables
from scalpel_sim.saved_run.layout import (
    CELL_FIELDS,
    CELL_OFFSETS,
    CONNECTIVITY,
    CONNECTIVITY_OFFSETS,
    COUNTS,
    N_PARTS,
    OFFSETS,
    OWN,
    PART_OFFSETS,
    POINT_FIELDS,
    POINT_OFFSETS,
    POSITIONS,
    SURFACE_FIELDS,
    TYPES,
    VTK,
    field_offsets,
    field_table,
)
from tissue import IntArray, Snapshot, piece_of_tetrahedra

_TETRAHEDRON = 10
"""VTK's number for a tetrahedron with four nodes."""

SYMMETRIC = (0, 4, 8, 1, 5, 2)
"""Places of xx, yy, zz, xy, yz, xz, VTK's order, in a tensor row by row."""


class BodyWriter:
    """Adds the body to tables, step by step; what has not changed is not written again.

    Args:
        file: The tables.
    """

    def __init__(self, file: GrowingTables) -> None:
        self._file = file
        self._written: dict[str, tuple[bytes, int]] = {}  # the last rows, and where they begin
        self._forget_mesh()
        self._cuts = CutTimes()

    def _forget_mesh(self) -> None:
        self._tetrahedra: IntArray = np.empty((0, 4), np.int64)
        self._n_points = 0
        self._pieces: IntArray = np.empty(0, np.int64)

    def begin_again(self, path: Path) -> None:
        """Continue after the last step of the file, with what it knows of faces of cuts.

        Args:
            path: The file.
        """
        import h5py

        self._written.clear()
        self._forget_mesh()
        with h5py.File(path) as file:
            first, count = file[f"{OWN}/steps/first_cut"][-1]
            self._cuts.begin_again(file[f"{OWN}/first_cut"][first : first + count])

    def add(self, link: TissueLink, time: float) -> None:
        """Add the body as it is now.

        Args:
            link: The tissue.
            time: Simulated time [s].
        """
        snapshot, deformation, surface = link.snapshot(), link.deformation(), link.surface()
        if len(snapshot.positions) != self._n_points or not np.array_equal(
            snapshot.tetrahedra, self._tetrahedra
        ):
            self._begin_mesh(snapshot)
        self._cuts.update(link, snapshot, surface, time)
        file = self._file
        file.append(PART_OFFSETS, file.length(f"{VTK}/{COUNTS[0]}") - 1)
        file.append(N_PARTS, 1)
        file.append(POINT_OFFSETS, self._shared(POSITIONS, snapshot.positions.astype("f4"))[0])
        file.append(CONNECTIVITY_OFFSETS, file.length(CONNECTIVITY) - self._tetrahedra.size)
        file.append(CELL_OFFSETS, file.length(TYPES) - len(self._tetrahedra))
        stress, strain = (each.reshape(-1, 9) for each in (deformation.stress, deformation.strain))
        fields: dict[str, npt.NDArray[np.generic]] = {
            "velocity": snapshot.velocities,
            "cut_age": time - self._cuts.times,
            "rest_position": snapshot.rest_positions,
            "mass": snapshot.masses,
            "fixed": snapshot.fixed,
            "stress": stress,
            "strain": strain[:, SYMMETRIC],
            "von_mises": deformation.von_mises(),
            "label": snapshot.labels,
            "piece": self._pieces,
        }
        for where, group in (("PointData", POINT_FIELDS), ("CellData", CELL_FIELDS)):
            for name, kind, _ in group:
                first, _ = self._shared(field_table(where, name), fields[name].astype(kind))
                file.append(field_offsets(where, name), first)
        no_labels = np.empty(0, np.int64)
        skin: dict[str, npt.NDArray[np.generic]] = {
            "surface/positions": surface.positions,
            "surface/rest_positions": surface.rest_positions,
            "surface/strain": link.surface_values("strain"),
            "surface/stress": link.surface_values("stress"),
            "surface/triangles": surface.triangles,
            "surface/is_cut": surface.is_cut,
            "surface/labels": no_labels if surface.labels is None else surface.labels,
            "first_cut": self._cuts.times,
        }
        for name, kind, _ in SURFACE_FIELDS:
            file.append(
                f"{OWN}/steps/{name}", self._shared(f"{OWN}/{name}", skin[name].astype(kind))
            )

    def _begin_mesh(self, snapshot: Snapshot) -> None:
        """Write another mesh."""
        file, tetrahedra = self._file, snapshot.tetrahedra
        self._tetrahedra, self._n_points = tetrahedra, len(snapshot.positions)
        self._pieces = piece_of_tetrahedra(snapshot)
        for name, count in zip(
            COUNTS, (self._n_points, len(tetrahedra), tetrahedra.size), strict=True
        ):
            file.append(f"{VTK}/{name}", count)
        file.append(CONNECTIVITY, tetrahedra.ravel())
        file.append(OFFSETS, 4 * np.arange(len(tetrahedra) + 1))
        file.append(TYPES, np.full(len(tetrahedra), _TETRAHEDRON))

    def _shared(self, name: str, rows: npt.NDArray[np.generic]) -> tuple[int, int]:
        """Return where rows are in a table, and how many; write them where they are others."""
        content = rows.tobytes()
        if name not in self._written or self._written[name][0] != content:
            self._written[name] = content, self._file.append(name, rows)
        return self._written[name][1], len(rows)
