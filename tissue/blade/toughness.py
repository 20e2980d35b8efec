"""What it takes an edge to cut: energy per area, more of it at speed, and to break the skin."""

from tissue.blade_shape import BladeShape
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.material import Material


class Resistance(Arrays):
    """Energy that an area of cut costs."""

    toughness: float
    """Of a slow cut [J/m2]."""
    skin_toughness: float
    """Until the edge has broken in [J/m2]."""
    exponent: float
    """Of the dependence on speed; 0 for none."""
    speed: float
    """At which toughness is twice that of a slow cut [m/s]."""


def resistance_of(material: Material, shape: BladeShape | None) -> Resistance:
    """Return what this tissue sets against this edge; None is a perfectly sharp one.

    An edge of radius r does not part two faces, it destroys a layer as thick as itself: 2 r times
    the work to rupture is added to the toughness. That is the slope over the radius that Zhang and
    Hutchens (2021, Soft Matter 17: 6728) find in cutting against tearing.
    """
    blunt = 0.0 if shape is None else 2.0 * shape.edge_radius * material.work_to_rupture
    return Resistance(
        toughness=float(material.toughness + blunt),
        skin_toughness=float(max(material.skin_toughness, material.toughness) + blunt),
        exponent=float(material.toughness_exponent),
        speed=float(material.toughness_speed),
    )


@kernel
def toughness_at(resistance: Resistance, speed: float) -> float:
    """Energy per area of a cut that grows at that speed [J/m2]: J0 (1 + (v / v0)^n)."""
    if resistance.exponent == 0.0 or speed <= 0.0:
        return resistance.toughness
    more = (speed / resistance.speed) ** resistance.exponent
    return resistance.toughness * (1.0 + more)
