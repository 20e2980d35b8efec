"""The energy that cutting takes per area: more at speed, and more until the skin is broken."""

import logging
import math

import numpy as np

from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.material import Material
from tissue.mesh.material_table import MaterialArrays

TOUGHEST = {"springs": 0.6, "neo_hookean": 2.0}
"""Toughness over Young's modulus, in mean node sizes, up to which steady forces are within 5 % of
toughness times depth. Springs were 2 to 9 % high at 0.8 and 57 % at 1.5, where the blade paid for
60 % of what it opened. Tetrahedra were within 3 % at 2.3, but there the force of the first
centimetres dropped to 58 %. Laws that stiffen have no such limit."""

TOUGHNESS, SKIN, ANCHOR, SIDE = range(4)
"""Columns of `ToughnessLaw.relative`."""

_log = logging.getLogger("tissue")


class ToughnessLaw(Arrays):
    """Energy per area of cut, as a function of the speed of the edge."""

    toughness: float
    """Energy per area of a slow cut [J/m2]."""
    skin_toughness: float
    """Energy per area until the edge has broken the skin, in a slow cut [J/m2]."""
    exponent: FloatArray
    """Exponent of the dependence on speed of each material of the body; 0 for none. Shape
    (n_materials,)."""
    doubling_speed: FloatArray
    """Speed at which the toughness of each is twice that of a slow cut [m/s], shape
    (n_materials,)."""
    blunt: FloatArray
    """The part of the toughness of each material that the radius of the edge adds [J/m2], shape
    (n_materials,)."""
    relative: FloatArray
    """Numbers of each material of the body over those of the first, shape (n_materials, 4):
    toughness, skin toughness, stiffness of anchors, and of blunt sides (`TOUGHNESS` and so on)."""
    label: IntArray
    """Place of the label of each material among the labels of the body, shape (n_materials,)."""


def toughness_law_of(material: Material, shape: BladeShape | None) -> ToughnessLaw:
    """Return the law of this tissue and this edge; None is a perfectly sharp edge.

    An edge of radius r does not part two faces, it destroys a layer as thick as itself: 2 r times
    the work to rupture is added to the toughness. That is the slope over the radius that Zhang and
    Hutchens (2021, Soft Matter 17: 6728) find in cutting against tearing.
    """
    blunt = 0.0 if shape is None else 2.0 * shape.edge_radius * material.work_to_rupture
    return ToughnessLaw(
        toughness=float(material.toughness + blunt),
        skin_toughness=float(max(material.skin_toughness, material.toughness) + blunt),
        exponent=np.array([float(material.toughness_exponent)]),
        doubling_speed=np.array([float(material.toughness_speed)]),
        blunt=np.full(1, blunt),
        relative=np.ones((1, 4)),
        label=np.zeros(1, dtype=np.int64),
    )


def blunt_toughness(materials: MaterialArrays, shape: BladeShape | None) -> FloatArray:
    """Return what the radius of the edge adds to the toughness of each material [J/m2]."""
    layer = 0.0 if shape is None else 2.0 * shape.edge_radius
    return layer * materials.work_to_rupture


def toughness_of_materials(
    materials: MaterialArrays, shape: BladeShape | None
) -> tuple[FloatArray, FloatArray]:
    """Return toughness and skin toughness of each material for this edge [J/m2]."""
    blunt, toughness = blunt_toughness(materials, shape), materials.toughness
    return toughness + blunt, np.maximum(materials.skin_toughness, toughness) + blunt


@kernel
def depends_on_speed(law: ToughnessLaw) -> bool:
    """Return whether the toughness of any material does."""
    highest = 0.0
    for exponent in law.exponent:
        highest = max(highest, exponent)
    return highest > 0.0


@kernel
def toughening_at(law: ToughnessLaw, material: int, speed: float) -> float:
    """Return the share by which tissue is tougher at a speed [m/s] than in a slow cut: (v / v0)^n.

    The power takes as long as the rest of the force of an anchor.

    Args:
        law: The law.
        material: Row of the tissue among the materials of the body.
        speed: Speed of the edge [m/s].
    """
    exponent: float = law.exponent[material]
    if exponent == 0.0 or speed <= 0.0:
        return 0.0
    return (speed / law.doubling_speed[material]) ** exponent  # type: ignore[no-any-return]


@kernel
def toughness_of(law: ToughnessLaw, relative: FloatArray, k: int, toughening: float) -> float:
    """Return the energy per area of a cut: J0 (1 + (v / v0)^n) [J/m2].

    Args:
        law: The law.
        relative: `ToughnessLaw.relative` of the tissue that each sample is in, shape (n, 4).
        k: The sample.
        toughening: `toughening_at` its speed.
    """
    toughness: float = relative[k, TOUGHNESS] * law.toughness * (1.0 + toughening)
    return toughness


@kernel
def skin_toughness_of(law: ToughnessLaw, relative: FloatArray, k: int, toughening: float) -> float:
    """Return the energy per area of breaking the skin [J/m2]; see `toughness_of`.

    It is that of the skin, or that of the tissue at this speed where that is more.
    """
    skin: float = relative[k, SKIN] * law.skin_toughness
    return max(skin, toughness_of(law, relative, k, toughening))


def expect_toughness_in_range(material: Material, node_size: float) -> None:
    """Check that a blade would not fold the springs of a body.

    Args:
        material: What the body is made of.
        node_size: Mean node size of its mesh [m].

    Raises:
        ValueError: it would, and the force would be that of the fold.
    """
    if material.law.has_springs and _is_too_tough(material, node_size):
        raise ValueError(
            f"{_toughness_in_nodes(material, node_size)}: springs fold ahead of the blade above "
            f"{TOUGHEST['springs']:g}, and the force would be that of the fold. Use law "
            "neo_hookean, a lower toughness, a stiffer material or a coarser mesh"
        )


def warn_of_toughness(material: Material, node_size: float) -> None:
    """Log a warning if the blade will strain tetrahedra beyond the range of their law.

    Args:
        material: What the body is made of.
        node_size: Mean node size of its mesh [m].
    """
    if not material.law.has_springs and _is_too_tough(material, node_size):
        _log.warning(
            "%s: tetrahedra ahead of the blade are strained beyond the range of law %s, and the "
            "force of the first centimetres drops to some 60 %% where elements open. Use a lower "
            "toughness, a stiffer material, or a law that stiffens, exponential",
            _toughness_in_nodes(material, node_size),
            material.law.name,
        )


def _is_too_tough(material: Material, node_size: float) -> bool:
    """Return whether toughness over Young's modulus is beyond the range of the law."""
    length = material.toughness / material.young_modulus
    return length > TOUGHEST.get(material.law.name, math.inf) * node_size


def _toughness_in_nodes(material: Material, node_size: float) -> str:
    """Return toughness over Young's modulus, in words."""
    length = material.toughness / material.young_modulus
    return (
        f"toughness / young_modulus is {length * 1e3:.3g} mm, {length / node_size:.3g} times the "
        f"mean node size of {node_size * 1e3:.3g} mm"
    )
