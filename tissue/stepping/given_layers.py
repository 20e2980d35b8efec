"""Layers between labels: from what a user gives to the rows that kernels read."""

import math
from collections.abc import Mapping, Sequence
from typing import TypeGuard

import numpy as np
import numpy.typing as npt

from tissue.body_materials import BodyMaterials, LabelKey, materials_of
from tissue.material import Material
from tissue.mesh.body import build_links
from tissue.mesh.interfaces import Interfaces, no_interfaces
from tissue.mesh.parts import labels_of_part
from tissue.types import TetrahedralMesh

LabelPair = tuple[int | str, int | str]
"""Two parts that have a layer between them: labels by number or name, or bodies by name."""

MaterialOf = Material | Mapping[LabelKey | LabelPair, Material | float]
"""A material; or one for each label, and a toughness [J/m2] for pairs of labels."""


def materials_and_layers(
    mesh: TetrahedralMesh, given: MaterialOf, *, averages_shear: bool
) -> tuple[BodyMaterials, Interfaces]:
    """Return what the tetrahedra of a mesh are made of, and the layers between its labels.

    Args:
        mesh: The mesh, with the labels of its tetrahedra, if there are any.
        given: One material, or one for each label, and a toughness for pairs of them.
        averages_shear: Whether a share of the shear of tetrahedra is averaged around nodes.

    Raises:
        ValueError: see `materials_of` and `interfaces_of`.
        TypeError: a label is given a number.
    """
    materials = _without_layers(given)
    return materials_of(mesh, materials, averages_shear=averages_shear), interfaces_of(mesh, given)


def _without_layers(given: MaterialOf) -> Material | dict[LabelKey, Material]:
    """Return the materials alone.

    Raises:
        TypeError: a label is given a number.
    """
    if isinstance(given, Material):
        return given
    found: dict[LabelKey, Material] = {}
    for label, each in given.items():
        if isinstance(label, tuple):
            continue
        if not isinstance(each, Material):
            raise TypeError(f"label {label!r} is given {each!r}; a label has a material")
        found[label] = each
    return found


def interfaces_of(mesh: TetrahedralMesh, given: MaterialOf) -> Interfaces:
    """Return the layers between the parts of a mesh, a row for each two labels that share faces.

    Raises:
        ValueError: there is no such part, a pair is one part, is given twice or shares no face, or
            its toughness is not finite and at least 0.
    """
    pairs = {} if isinstance(given, Material) else given
    toughness: dict[tuple[int, int], float] = {}
    touching = _touching(mesh) if any(isinstance(pair, tuple) for pair in pairs) else set()
    labels = np.zeros(1, np.int64) if mesh.labels is None else np.unique(mesh.labels)
    for pair, each in pairs.items():
        if not isinstance(pair, tuple):
            continue
        where = f"the layer between {' and '.join(repr(part) for part in pair)}"
        if isinstance(each, Material) or not (math.isfinite(each) and each >= 0.0):
            raise ValueError(f"{where} has toughness {each}; it is a number [J/m2], at least 0")
        rows = _rows_of(labels.tolist(), mesh.label_names, pair) & touching
        if not rows:
            raise ValueError(
                f"{where}: no tetrahedra of the two share a face in this mesh, so that nothing is "
                "between them"
            )
        if rows & toughness.keys():
            raise ValueError(f"{where} is given twice")
        toughness |= dict.fromkeys(sorted(rows), float(each))
    if not toughness:
        return no_interfaces()
    return Interfaces.new(
        {"layers": len(toughness)},
        label=np.array(list(toughness), dtype=np.int64),
        toughness=np.array(list(toughness.values())),
    )


def _rows_of(
    present: Sequence[int], names: Mapping[int, str], pair: LabelPair
) -> set[tuple[int, int]]:
    """Return the labels of two parts, in pairs with the lower one first.

    Args:
        present: The labels that there are.
        names: Their names, of those that have one.
        pair: The two parts (`tissue.mesh.parts.labels_of_part`).

    Raises:
        ValueError: there is no such part, or a label is in both.
    """
    if len(pair) != 2:
        raise ValueError(f"a layer is between two labels, not {pair!r}")
    first, second = (labels_of_part(present, names, part) for part in pair)
    if set(first) & set(second):
        raise ValueError(
            f"the layer between {pair[0]!r} and {pair[1]!r} is between a part and itself; it is "
            "where two parts meet"
        )
    return {(min(a, b), max(a, b)) for a in first for b in second}


def is_pair(where: object) -> TypeGuard[LabelPair]:
    """Return whether two labels are meant, and no mask."""
    return (
        isinstance(where, tuple)
        and len(where) == 2
        and all(isinstance(e, int | np.integer | str) and not isinstance(e, bool) for e in where)
    )


def scale_layer(
    interfaces: Interfaces,
    names: Mapping[int, str],
    pair: LabelPair,
    factors: Mapping[str, npt.ArrayLike],
) -> None:
    """Multiply the toughness of the layer between two parts.

    Args:
        interfaces: The layers; written.
        names: Names of labels.
        pair: The two parts.
        factors: A factor of `toughness`.

    Raises:
        ValueError: there is no such layer, or another factor is given.
    """
    pairs = _rows_of(np.unique(interfaces.label).tolist(), names, pair)
    rows = [row for row, each in enumerate(interfaces.label.tolist()) if tuple(each) in pairs]
    if not rows:
        raise ValueError(f"there is no layer between {pair[0]!r} and {pair[1]!r}")
    factor = np.asarray(factors.get("toughness", np.nan), dtype=np.float64)
    if set(factors) != {"toughness"} or factor.shape or not 0.0 < factor < math.inf:
        raise ValueError(
            f"of a layer a factor of toughness can be given, a positive number, not {factors}"
        )
    interfaces.toughness[rows] *= factor


def _touching(mesh: TetrahedralMesh) -> set[tuple[int, int]]:
    """Return the labels that share faces, in pairs with the lower one first."""
    if mesh.labels is None:
        return set()
    links = build_links(np.ascontiguousarray(mesh.tetrahedra, dtype=np.int64))
    own = np.repeat(mesh.labels, 4).reshape(-1, 4)
    behind = np.where(links >= 0, mesh.labels[links // 4], own)
    pairs = np.unique(np.stack([own, behind], axis=-1)[own < behind], axis=0)
    return {(low, high) for low, high in pairs.tolist()}
