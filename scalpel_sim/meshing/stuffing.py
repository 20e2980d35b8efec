"""Tetrahedra inside the labels of a volume, with shared faces where two labels meet."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from scipy.ndimage import gaussian_filter, map_coordinates

from scalpel_sim.errors import UsageError
from scalpel_sim.meshing.chosen_labels import chosen_labels
from scalpel_sim.meshing.label_volume import LabelVolume, read_label_volume
from scalpel_sim.meshing.mended_mesh import mended_mesh
from scalpel_sim.meshing.meshed import Meshed
from scalpel_sim.meshing.sizes import N_TETRAHEDRA
from scalpel_sim.meshing.units import scale_of
from tissue import BoolArray, FloatArray, IntArray

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

TETRAHEDRA_OF_CELL = 12.0
"""Tetrahedra of the lattice in a cell of it."""

EDGE_OF_CELL = 0.91
"""Mean edge of the tetrahedra of the lattice per edge of its cells."""

SMOOTHED = 0.25
"""Width of the smoothing per edge of a cell: steps of voxels vanish, and what cells can show does
not."""

LEAST_SMOOTHED = 0.7
"""The same per voxel."""

SAMPLES_OF_CELL = 3.0
"""Samples of the smoothed labels along a cell at least; finer voxels are averaged first."""

VOLUME_ERROR = 0.003
"""Share of its volume in the file by which the volume of a label may differ before it is met."""

MOST_FILLINGS = 7
"""Meshes that are made to meet the volumes."""

SHARE_OF_WAY = 0.6
"""Share of the way to its volume by which a surface is moved at once. Where one label gains what
its neighbour loses, both move their common surface: with the whole way they would go to and fro."""

LARGEST_OFFSET = 0.4
"""Of a smoothed label, which goes from 0 to 1: a larger one would move the surface by more than the
width of the smoothing."""


def stuff_volume(
    path: Path,
    *,
    scale: float | None = None,
    edge_length: float | None = None,
    keep_labels: str | None = None,
    label: Sequence[str] = (),
    on_progress: Callable[[str], None] = lambda text: None,
) -> Meshed:
    """Return tetrahedra inside the labels of a volume, each with its label.

    The labels are smoothed by a fraction of the edge length, and shifted so that each has the
    volume that it has in the file.

    Args:
        path: A NIfTI or NRRD file.
        scale: Its unit in metres. None: what it says.
        edge_length: Of the tetrahedra [m]. None: so that the mesh has some 5,000.
        keep_labels: Labels to take, `3,5`. None: all.
        label: Labels to join and to name, each `3,5=liver`.
        on_progress: Called with a line to show.

    Raises:
        UsageError: the file is broken, its unit has to be given, or it has no such labels.
        MeshError: what was made is no sound mesh.
    """
    on_progress(f"reading {path.name}")
    volume = read_label_volume(path, scale)
    chosen = chosen_labels(volume.labels, volume.names, keep_labels, label)
    numbers = sorted(set(chosen.joined.values()))
    order = {number: k + 1 for k, number in enumerate(numbers)}
    table = np.zeros(int(volume.labels.max()) + 1, dtype=np.int64)
    for number, joined in chosen.joined.items():
        table[number] = order[joined]
    volume = volume._replace(labels=table[volume.labels])
    inside = volume.labels > 0
    width = float((np.ptp(np.argwhere(inside), axis=0) + 1).max() * volume.voxel_sides().max())
    scale_of(path, width, 1.0)
    if edge_length is None:
        cell = np.cbrt(TETRAHEDRA_OF_CELL * inside.sum() * volume.voxel_volume() / N_TETRAHEDRA)
    else:
        if not 0.0 < edge_length < np.inf:
            raise UsageError(f"--edge-length is {edge_length:g} m; it must be positive")
        cell = edge_length / EDGE_OF_CELL
    mesh = _stuffed(volume, len(numbers), float(cell), on_progress)
    assert mesh.labels is not None
    mesh = mesh._replace(labels=np.array([0, *numbers])[mesh.labels], label_names=chosen.names)
    on_progress("mending")
    made = mended_mesh(mesh, float(np.linalg.norm(np.ptp(mesh.positions, axis=0))))
    lost = _lost(made.mesh, volume, numbers)
    return Meshed(made.mesh, (*volume.notes, *made.notes, *lost))


def _lost(mesh: "TetrahedralMesh", volume: LabelVolume, numbers: Sequence[int]) -> list[str]:
    """Return what to say of labels whose volumes are not those of the file within a percent."""
    from tissue.support import signed_volumes

    assert mesh.labels is not None
    volumes, changed = signed_volumes(mesh.positions, mesh.tetrahedra), []
    for k, number in enumerate(numbers):
        own = volumes[mesh.labels == number].sum()
        wanted = (volume.labels == k + 1).sum() * volume.voxel_volume()
        if abs(own / wanted - 1.0) > 0.01:
            name = mesh.label_names.get(number, str(number))
            changed.append(f"{name} {own / wanted - 1.0:+.1%}" if own else f"{name} lost")
    if not changed:
        return []
    return [
        f"volumes against those in the file, by label: {', '.join(changed)}. Parts thinner than an "
        "edge are lost; a smaller --edge-length, or fewer labels (--keep-labels), keeps them"
    ]


def _stuffed(
    volume: LabelVolume, n_labels: int, cell: float, on_progress: Callable[[str], None]
) -> "TetrahedralMesh":
    """Return a mesh in which each label has the volume that it has in the file."""
    from tissue import mesh_from_arrays
    from tissue.support import signed_volumes, stuff_labels

    on_progress("smoothing the labels")
    depths = _Depths(volume, n_labels, cell)
    counts = np.bincount(volume.labels.ravel(), minlength=n_labels + 1)[1:]
    wanted = np.asarray(counts * volume.voxel_volume(), dtype=np.float64)
    best, least = None, np.inf
    for done in range(MOST_FILLINGS):
        on_progress(f"filling {n_labels} labels: round {done + 1} of at most {MOST_FILLINGS}")
        mesh = stuff_labels(depths, n_labels, depths.bounds, cell)
        assert mesh.labels is not None
        volumes = signed_volumes(mesh.positions, mesh.tetrahedra)
        own = np.bincount(mesh.labels, volumes, minlength=n_labels + 1)[1:]
        # A label that is smaller than a cell is in no mesh: it must not decide which is best.
        error = float(np.abs(own - wanted).sum() / wanted.sum())
        if error < least:
            best, least = mesh, error
        if np.abs(own / wanted - 1.0).max() < VOLUME_ERROR:
            break
        depths.grow(np.asarray(wanted - own, dtype=np.float64), _areas(mesh, n_labels))
    assert best is not None
    return mesh_from_arrays(best.positions, best.tetrahedra, best.labels)


def _areas(mesh: "TetrahedralMesh", n_labels: int) -> FloatArray:
    """Return the area of the surface of each label [m2], shape (n_labels,)."""
    from tissue import boundary_faces

    assert mesh.labels is not None
    areas = np.zeros(n_labels)
    for k in range(n_labels):
        own = mesh.tetrahedra[mesh.labels == k + 1]
        if len(own):
            a, b, c = mesh.positions[boundary_faces(own)].swapaxes(0, 1)
            areas[k] = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    return areas


class _Depths:
    """Depths of points in each label: the share of it around the point, from 0 to 1."""

    def __init__(self, volume: LabelVolume, n_labels: int, cell: float) -> None:
        sides = volume.voxel_sides()
        width = np.maximum(SMOOTHED * cell / sides, LEAST_SMOOTHED)  # in voxels
        step = np.maximum(1, (cell / SAMPLES_OF_CELL / sides).astype(np.int64))
        margin = np.ceil(4.0 * width).astype(np.int64) + 2 * step
        where = np.argwhere(volume.labels > 0)
        first, last = where.min(axis=0), where.max(axis=0) + 1
        n = -(-(last - first + 2 * margin) // step) * step
        labels = np.zeros(n, dtype=np.int64)
        inner = tuple(slice(m, m + e - f) for m, f, e in zip(margin, first, last, strict=True))
        labels[inner] = volume.labels[tuple(map(slice, first, last))]
        self._fields = [
            gaussian_filter(_averaged(labels == k, step), width / step) for k in range(n_labels + 1)
        ]
        # A sample is in the middle of the voxels of which it is the mean.
        linear = volume.to_metres[:, :3] * step
        middle = volume.to_metres[:, :3] @ (first - margin + 0.5 * (step - 1))
        self._origin = volume.to_metres[:, 3] + middle
        self._from_metres = np.linalg.inv(linear)
        corners = np.indices((2, 2, 2)).reshape(3, -1).T * (np.array(self._fields[0].shape) - 1)
        places = corners @ linear.T + self._origin
        self.bounds = np.stack([places.min(axis=0), places.max(axis=0)])
        self._offsets = np.zeros(n_labels + 1)
        # A plane that is smoothed has this slope [1/m].
        self._slope = 1.0 / (np.sqrt(2.0 * np.pi) * float((width * sides).mean()))

    def __call__(self, points: FloatArray, labels: IntArray) -> FloatArray:
        """Return how deep each of `points` [m] is in each of `labels`."""
        places = self._from_metres @ (points - self._origin).T
        depths = np.empty(len(points))
        for label in np.unique(labels):
            own = labels == label
            around = float(label == 0)  # outside of all there is nothing but the outside
            depths[own] = self._offsets[label] + map_coordinates(
                self._fields[label], places[:, own], order=1, mode="constant", cval=around
            )
        return depths

    def grow(self, lacking: FloatArray, areas: FloatArray) -> None:
        """Move the surfaces of labels outwards.

        Args:
            lacking: Volume that each label lacks [m3], shape (n_labels,).
            areas: Of its surface [m2].
        """
        ways = lacking / np.maximum(areas, np.finfo(np.float64).tiny)
        offsets = self._offsets[1:] + SHARE_OF_WAY * 2.0 * self._slope * ways
        self._offsets[1:] = np.clip(offsets, -LARGEST_OFFSET, LARGEST_OFFSET)


def _averaged(is_own: BoolArray, step: IntArray) -> FloatArray:
    """Return the share of a label in each block of `step` voxels."""
    a, b, c = (n // s for n, s in zip(is_own.shape, step, strict=True))
    blocks = is_own.reshape(a, step[0], b, step[1], c, step[2])
    share: FloatArray = blocks.mean(axis=(1, 3, 5))
    return share
