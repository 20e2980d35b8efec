"""The materials of a body from those of its labels, checked, and their changes between episodes."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.material import Material
from tissue.mesh.material_table import SCALED, MaterialArrays
from tissue.mesh.parts import MOST_NAMED, described_label, labels_of_part
from tissue.types import TetrahedralMesh

ALIKE_WITH_SPRINGS = ("retardation_time",)
"""Quantities that all materials of a body share where springs carry the shear: dampers have the
stiffness of springs."""

LabelKey = int | str | None
"""A label by its number, or by its name in the file of the mesh; a body, by its name, with all its
labels; None: all that are not given."""


class BodyMaterials(NamedTuple):
    """Materials of the tetrahedra of a body."""

    table: MaterialArrays
    """The materials, each with its label."""
    rows: IntArray
    """Row of each tetrahedron, shape (n_tets,)."""
    reference: Material
    """One of them, for what all share: that which resists changes of volume most."""
    by_label: Mapping[int, Material]
    """The material of each label that is in the mesh, in order."""


def materials_of(
    mesh: TetrahedralMesh,
    material: Material | Mapping[LabelKey, Material],
    *,
    averages_shear: bool,
) -> BodyMaterials:
    """Return what the tetrahedra of a mesh are made of.

    Args:
        mesh: The mesh, with the labels of its tetrahedra, if there are any.
        material: One material, or one for each label.
        averages_shear: Whether a share of the shear of tetrahedra is averaged around nodes.

    Raises:
        ValueError: there is no such label, one has no material, or materials differ in what they
            must share.
    """
    n = len(mesh.tetrahedra)
    labels = np.zeros(n, np.int64) if mesh.labels is None else mesh.labels
    found, rows = np.unique(labels, return_inverse=True)
    present = found.tolist()
    used = _of_labels(present, mesh.label_names, material)
    reference = max(used.values(), key=lambda each: (each.volume_modulus, each.young_modulus))
    for label, each in used.items():
        _expect_alike(described_label(mesh.label_names, label), each, reference)
    table = MaterialArrays.of(list(used.values()), list(used), averages_shear=averages_shear)
    return BodyMaterials(table, rows.reshape(n).astype(np.int64), reference, used)


def _of_labels(
    present: Sequence[int],
    names: Mapping[int, str],
    material: Material | Mapping[LabelKey, Material],
) -> dict[int, Material]:
    """Return the material of each label that is present.

    Raises:
        ValueError: there is no such label, or one has no material.
    """
    if isinstance(material, Material):
        return dict.fromkeys(present, material)
    given = {
        number: each
        for label, each in _of_bodies_first(material)
        for number in labels_of_part(present, names, label)
    }
    rest = material.get(None)
    lacking = [described_label(names, label) for label in present if label not in given]
    if lacking and rest is None:
        raise ValueError(
            f"no material is given for label {', '.join(lacking[:MOST_NAMED])}; None: in place of "
            "a label stands for all others"
        )
    return {label: given[label] if label in given else rest or Material() for label in present}


def _of_bodies_first(
    material: Mapping[LabelKey, Material],
) -> list[tuple[int | str, Material]]:
    """Return the labels that materials are given for: `body` before `body/label`, numbers last."""
    found = [(label, each) for label, each in material.items() if label is not None]
    return sorted(found, key=lambda pair: len(pair[0]) if isinstance(pair[0], str) else math.inf)


def chosen(
    table: MaterialArrays,
    rows: IntArray,
    names: Mapping[int, str],
    where: int | str | npt.ArrayLike | None,
) -> BoolArray:
    """Return which tetrahedra a label or a mask chooses, shape (n_tets,).

    Args:
        table: The materials.
        rows: Row of each tetrahedron, shape (n_tets,).
        names: Names of labels.
        where: A label, by number or name; a mask, shape (n_tets,); None for all.

    Raises:
        ValueError: no tetrahedron has the label or is in the mask, or it has another shape.
    """
    if where is None:
        return np.ones(len(rows), dtype=np.bool_)
    if isinstance(where, (int, np.integer, str)) and not isinstance(where, bool):
        present = np.unique(table.label[rows]).tolist()
        label = where if isinstance(where, str) else int(where)
        return np.isin(table.label[rows], labels_of_part(present, names, label))
    mask = np.asarray(where)
    if mask.shape != rows.shape or mask.dtype != np.bool_:
        raise ValueError(
            f"where has shape {mask.shape} and type {mask.dtype}; it is a label, or one truth "
            f"value for each of the {len(rows)} tetrahedra"
        )
    if not mask.any():
        raise ValueError("where is true for no tetrahedron")
    return mask


def _expect_alike(name: str, one: Material, other: Material) -> None:
    """Refuse a material that differs in what all materials of a body share.

    Raises:
        ValueError: it does.
    """
    where = f"label {name}"
    if type(one.law) is not type(other.law):
        raise ValueError(
            f"{where} has law {one.law.name} and the rest of the body {other.law.name}: one body "
            "has one law. Moduli, and how much a law stiffens, may differ from label to label"
        )
    for quantity in ALIKE_WITH_SPRINGS * one.law.has_springs:
        mine, theirs = getattr(one, quantity), getattr(other, quantity)
        if mine != theirs:
            raise ValueError(
                f"{where} has {quantity} {mine} and the rest of the body {theirs}: it is the same "
                "in all of a body of law springs, whose dampers have the stiffness of springs"
            )


def scaled(
    table: MaterialArrays, rows: IntArray, where: BoolArray, factors: Mapping[str, npt.ArrayLike]
) -> tuple[MaterialArrays, IntArray]:
    """Return the table, and the row of each tetrahedron, with quantities of some of them changed.

    Args:
        table: The materials.
        rows: Row of each tetrahedron, shape (n_tets,).
        where: The tetrahedra whose material changes, shape (n_tets,).
        factors: Factors of quantities of `SCALED`: a number each, or one for each of the
            tetrahedra, shape (`where.sum()`,).

    Raises:
        ValueError: there is no such quantity, or a factor is not finite and positive.
    """
    numbers = dict(zip(factors, _checked_factors(factors, int(where.sum())), strict=True))
    of_these = kind = rows[where]
    for factor in numbers.values():  # a number for each row, and each factor, that occur together
        if factor.strides == (0,):  # one for all
            continue
        values, place = np.unique(factor, return_inverse=True)
        _, kind = np.unique(len(values) * kind + place.reshape(-1), return_inverse=True)
    _, first, kind = np.unique(kind, return_index=True, return_inverse=True)
    old = table.rows()
    new = old[of_these[first]].copy()
    columns = ("label", *table.quantities())
    for name, factor in numbers.items():
        for column in SCALED[name]:
            new[:, columns.index(column)] *= factor[first]
    all_rows = rows.copy()
    all_rows[where] = len(old) + kind.reshape(-1)
    kept, compact = np.unique(all_rows, return_inverse=True)
    together, where_to = np.unique(np.concatenate([old, new])[kept], axis=0, return_inverse=True)
    return MaterialArrays.of_rows(together), where_to.reshape(-1)[compact.reshape(-1)]


def _checked_factors(factors: Mapping[str, npt.ArrayLike], n: int) -> Iterator[FloatArray]:
    """Yield the factors of each quantity, shape (n,) each.

    Raises:
        ValueError: see `scaled`.
    """
    for name, factor in factors.items():
        if name not in SCALED:
            raise ValueError(
                f"{name} is no quantity that a factor can change; these are {', '.join(SCALED)}"
            )
        array = np.asarray(factor, dtype=np.float64)
        if array.shape not in ((), (n,)):
            raise ValueError(
                f"the factor of {name} has shape {array.shape}; it is a number, or one for each of "
                f"the {n} tetrahedra"
            )
        if not (np.isfinite(array).all() and (array > 0.0).all()):
            raise ValueError(f"the factor of {name} must be finite and positive, not {array}")
        yield np.broadcast_to(array, (n,))
