"""The body of the blade: a wedge behind the cutting edge, with a back, a point and a heel."""

import math
from dataclasses import dataclass, fields

STEEPEST_BEVEL = math.radians(60.0)
"""Largest angle of a bevel: a blunter wedge presses like a bar and does not cut."""


@dataclass(frozen=True)
class BladeShape:
    """The cross-section of a blade, the same all along its edge.

    Seen along the edge: two bevels rise from it, each by `bevel_angle` from the plane of the blade,
    until the blade is `thickness` thick; `height` behind the edge it ends. The defaults are those
    of a scalpel blade of carbon steel of the usual sizes (10, 11, 15).

    Raises:
        ValueError: a quantity is not finite or has the wrong sign, or the bevels do not fit.
    """

    thickness: float = 0.4e-3
    """Thickness of the blade [m]."""
    bevel_angle: float = math.radians(10.0)
    """Angle between each bevel and the plane of the blade, half of that of the wedge [rad]."""
    height: float = 6e-3
    """Distance from the edge to the back [m]."""
    edge_radius: float = 1e-6
    """Radius of the edge itself [m]: a new scalpel has about 1 um, a used one several. Tissue that
    meets a blunt edge is strained to rupture over its width: see `Material.work_to_rupture`."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            least_allowed = field.name == "edge_radius"
            if not math.isfinite(value) or value < 0.0 or (value == 0.0 and not least_allowed):
                raise ValueError(f"the blade's {field.name} is {value}; it must be positive")
        if self.bevel_angle > STEEPEST_BEVEL:
            raise ValueError(
                f"the blade's bevel_angle is {self.bevel_angle} rad, {self.bevel_degrees:.4g} "
                f"degrees; at most {math.degrees(STEEPEST_BEVEL):.0f}"
            )
        if self.bevel_length >= self.height:
            raise ValueError(
                f"bevels of {self.bevel_degrees:.1f} degrees take {self.bevel_length} m to reach a "
                f"thickness of {self.thickness} m, and the blade is only {self.height} m high"
            )

    @property
    def bevel_degrees(self) -> float:
        """`bevel_angle` in degrees."""
        return math.degrees(self.bevel_angle)

    @property
    def slope(self) -> float:
        """Rise of each bevel per length behind the edge."""
        return math.tan(self.bevel_angle)

    @property
    def bevel_length(self) -> float:
        """Distance from the edge to where the blade has its full thickness [m]."""
        return 0.5 * self.thickness / self.slope
