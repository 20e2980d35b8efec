"""Say so where a material asks for more than its law, or the time step, can bear."""

import logging
from dataclasses import replace

from tissue.material import NEARLY_INCOMPRESSIBLE, Material

TOUGHEST = {"springs": 0.3, "neo_hookean": 2.0}
"""Toughness over Young's modulus, in mean node sizes, up to which the cutting force is within 6 %
of that of the toughness, or 9 % with springs. Springs between the planes of the mesh were measured
2 % low at 0.14, 6 to 9 % at 0.3 to 0.6 and 20 % at 0.8 to 1.7 (along a plane 1 % at 0.84);
tetrahedra 3 % at 1.27, 5 % at 2.0 and 16 % at 2.5."""

HOW_LOW = {"springs": 20, "neo_hookean": 15}
"""Percent by which it was below it at most, beyond that."""

_log = logging.getLogger("tissue")


def warn_of_toughness(material: Material, node_size: float) -> None:
    """Say so where the blade strains tetrahedra more than their law can bear.

    Args:
        material: What the body is made of.
        node_size: Mean node size of its mesh [m].
    """
    length = material.toughness / material.young_modulus
    if length > TOUGHEST[material.law] * node_size:
        _log.warning(
            "toughness / young_modulus is %.1f mm, %.1f times the mean node size of %.1f mm: "
            "tetrahedra ahead of the blade are strained beyond what law %s bears, and the cutting "
            "force reads up to %d %% low. Use a lower toughness, a stiffer material, or %s",
            length * 1e3,
            length / node_size,
            node_size * 1e3,
            material.law,
            HOW_LOW[material.law],
            "law neo_hookean" if material.law == "springs" else "larger cells",
        )


def warn_of_ratio(material: Material) -> None:
    """Say so where the resistance to compression makes time steps very short."""
    ratio = material.poisson_ratio
    if ratio > NEARLY_INCOMPRESSIBLE:
        _log.warning(
            "poisson_ratio is %g: time steps are %.1f times shorter than at 0.45, because waves of "
            "compression are that much faster. 0.45 to 0.49 is as incompressible as a soft body "
            "looks",
            ratio,
            material.wave_speed / replace(material, poisson_ratio=0.45).wave_speed,
        )
