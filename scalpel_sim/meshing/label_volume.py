"""Label volumes from files: a whole number for each voxel, as segmentations have them."""

import contextlib
import importlib.util
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from scalpel_sim.errors import UsageError
from tissue import FloatArray, IntArray

VOLUME_FILES = (".nii", ".nii.gz", ".nrrd")
"""Endings of the files of label volumes that are read."""

MOST_VOXELS = 1_000_000_000
"""Voxels of the largest volume: 1,000 in each direction."""

_NIFTI_UNITS = {"meter": 1.0, "mm": 1e-3, "micron": 1e-6}
_NRRD_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "microns": 1e-6, "micron": 1e-6}
_USUAL_UNIT = 1e-3
"""Unit of medical images that do not name it [m]."""


class LabelVolume(NamedTuple):
    """Voxels with labels, and where they are."""

    labels: IntArray
    """Shape (n_x, n_y, n_z); 0 is what is outside of all."""
    to_metres: FloatArray
    """Turns the indices of a voxel into the place of its middle [m], shape (3, 4)."""
    names: Mapping[int, str]
    """Names of labels, where the file has them."""
    notes: tuple[str, ...] = ()

    def voxel_volume(self) -> float:
        """Return the volume of a voxel [m3]."""
        return abs(float(np.linalg.det(self.to_metres[:, :3])))

    def voxel_sides(self) -> FloatArray:
        """Return the sides of a voxel [m], shape (3,)."""
        sides: FloatArray = np.linalg.norm(self.to_metres[:, :3], axis=0)
        return sides


class _Raw(NamedTuple):
    """The contents of a file, in its own unit."""

    data: npt.NDArray[np.generic]
    affine: FloatArray
    """Shape (3, 4)."""
    unit: float | None
    """[m]; None: the file does not say."""
    names: dict[int, str]


def is_label_volume(path: Path) -> bool:
    """Return whether a file is that of a label volume, by its name."""
    return path.name.lower().endswith(VOLUME_FILES)


def read_label_volume(path: Path, scale: float | None) -> LabelVolume:
    """Return the label volume in a NIfTI or NRRD file, in metres.

    Args:
        path: The file.
        scale: Its unit in metres. None: what the file says; of one that says nothing millimetres,
            unless its voxels are 1 x 1 x 1, which says nothing either.

    Raises:
        UsageError: the file is broken, holds no labels, or the unit has to be given.
    """
    raw = _contents(path)
    data = raw.data
    while data.ndim > 3 and data.shape[-1] == 1:
        data = data[..., 0]
    if data.ndim != 3:
        raise UsageError(
            f"{path}: it has {data.ndim} dimensions, {data.shape}; a label volume has three. Of a "
            "segmentation in layers, or with a map for each label, save one volume of labels"
        )
    if data.dtype.kind not in "iuf" or (
        data.dtype.kind == "f" and not (np.isfinite(data).all() and (data == np.floor(data)).all())
    ):
        raise UsageError(
            f"{path}: voxels have numbers that are not whole, as images have; a label volume is "
            "needed, which a segmentation saves"
        )
    if not data.size or data.min() < 0 or data.max() == 0:
        low, high = (data.min(), data.max()) if data.size else (0, 0)
        raise UsageError(
            f"{path}: labels are 1, 2, 3, ... with 0 outside; there are {low} to {high}"
            + ", as in an image: a label volume is needed, which a segmentation of it saves"
            * bool(low < 0)
        )
    unit, notes = _unit(path, raw, scale)
    return LabelVolume(data.astype(np.int64), unit * raw.affine, raw.names, notes)


def _unit(path: Path, raw: _Raw, scale: float | None) -> tuple[float, tuple[str, ...]]:
    """Return the unit of a file [m], and what to say of it."""
    sides = np.linalg.norm(raw.affine[:, :3], axis=0)
    if not np.isfinite(raw.affine).all() or abs(np.linalg.det(raw.affine[:, :3])) == 0.0:
        raise UsageError(f"{path}: its voxels have no volume: sides of {sides.tolist()}")
    if scale is not None:
        if not 0.0 < scale < np.inf:
            raise UsageError(
                f"--scale is {scale:g}; it is the unit in metres: 0.001 is millimetres"
            )
        return scale, ()
    if raw.unit is not None:
        return raw.unit, ()
    if np.allclose(sides, 1.0):
        raise UsageError(
            f"{path}: it does not say how large a voxel is. Add --scale, the side of a voxel in "
            "metres: 0.001 for 1 mm"
        )
    wide = " x ".join(f"{side:.3g}" for side in sides)
    return _USUAL_UNIT, (
        f"voxels of {wide}, of a unit that is not named, are taken as millimetres",
    )


def _contents(path: Path) -> _Raw:
    """Return what a file holds."""
    is_nrrd = path.suffix.lower() == ".nrrd"
    package, name = ("nrrd", "pynrrd") if is_nrrd else ("nibabel", "nibabel")
    if importlib.util.find_spec(package) is None:
        raise UsageError(
            f"to read {path} {name} is needed: install the extra `mesh`, "
            "pip install 'scalpel-sim[mesh]'"
        )
    read: Callable[[Path], _Raw] = _read_nrrd if is_nrrd else _read_nifti
    if not path.is_file():
        raise UsageError(f"{path}: {'this is no file' if path.exists() else 'no such file'}")
    try:
        return read(path)
    except UsageError:
        raise
    except Exception as error:  # the readers raise whatever they meet
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        kind = "NRRD" if is_nrrd else "NIfTI"
        raise UsageError(
            f"{path}: this is no {kind} file, or it is cut short ({reason})"
        ) from error


def _expect_possible(path: Path, shape: tuple[int, ...]) -> None:
    """Refuse a volume that does not fit in memory, before it is read."""
    if np.prod([float(n) for n in shape]) > MOST_VOXELS:
        raise UsageError(f"{path}: {shape} voxels are more than {MOST_VOXELS:,}; crop the volume")


def _read_nifti(path: Path) -> _Raw:
    """Return what a NIfTI file holds."""
    import nibabel

    image: Any = nibabel.load(path)
    _expect_possible(path, image.shape)
    unit = _NIFTI_UNITS.get(image.header.get_xyzt_units()[0])
    affine = np.asarray(image.affine, dtype=np.float64)[:3]
    return _Raw(np.asarray(image.dataobj), affine, unit, {})


def _read_nrrd(path: Path) -> _Raw:
    """Return what an NRRD file holds; names are those of segments of 3D Slicer."""
    import nrrd

    header: dict[str, Any] = dict(nrrd.read_header(str(path)))
    _expect_possible(path, tuple(header.get("sizes", ())))
    data, _ = nrrd.read(str(path))
    directions = header.get("space directions")
    units = [str(each).strip('"') for each in header.get("space units", header.get("units", ()))]
    unit = _NRRD_UNITS.get(units[0].lower()) if units else None
    if directions is not None:
        rows = np.asarray(directions, dtype=np.float64)
        linear = rows[np.isfinite(rows).all(axis=1)].T
    else:
        linear = np.diag(np.asarray(header.get("spacings", np.ones(data.ndim)), dtype=np.float64))
    if linear.shape != (3, 3):
        linear = np.eye(3)
    origin = np.asarray(header.get("space origin", np.zeros(3)), dtype=np.float64)
    return _Raw(data, np.c_[linear, origin], unit, _segment_names(header))


def _segment_names(header: dict[str, Any]) -> dict[int, str]:
    """Return the names of the segments of 3D Slicer, by their labels."""
    names = {}
    for key, value in header.items():
        if key.startswith("Segment") and key.endswith("_LabelValue"):
            with contextlib.suppress(ValueError):
                label = int(value)
                names[label] = str(header.get(key.replace("_LabelValue", "_Name"), label))
    return names
