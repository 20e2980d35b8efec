"""The energy that cutting takes per area: more at speed, and more until the skin is broken."""

from tissue.blade_shape import BladeShape
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.material import Material


class ToughnessLaw(Arrays):
    """Energy per area of cut, as a function of the speed of the edge."""

    toughness: float
    """Energy per area of a slow cut [J/m2]."""
    skin_toughness: float
    """Energy per area until the edge has broken the skin, in a slow cut [J/m2]."""
    exponent: float
    """Exponent of the dependence on speed; 0 for none."""
    doubling_speed: float
    """Speed at which the toughness is twice that of a slow cut [m/s]."""


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
        exponent=float(material.toughness_exponent),
        doubling_speed=float(material.toughness_speed),
    )


@kernel
def toughness_at(law: ToughnessLaw, speed: float) -> float:
    """Return the energy per area of a cut at that speed [m/s]: J0 (1 + (v / v0)^n) [J/m2]."""
    if law.exponent == 0.0 or speed <= 0.0:
        return law.toughness
    more: float = (speed / law.doubling_speed) ** law.exponent
    return law.toughness * (1.0 + more)


@kernel
def skin_toughness_at(law: ToughnessLaw, speed: float) -> float:
    """Return the energy per area of breaking the skin at that speed [m/s]: [J/m2].

    It is that of the skin, or that of the tissue at this speed where that is more.
    """
    return max(law.skin_toughness, toughness_at(law, speed))
