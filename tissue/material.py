"""What the tissue is made of, in quantities that one can measure."""

import math
from dataclasses import dataclass, fields


@dataclass(frozen=True)
class Material:
    """An isotropic soft tissue.

    Raises:
        ValueError: a quantity is not finite, or has the wrong sign.
    """

    young_modulus: float = 10e3
    """Stiffness at small strain [Pa]."""
    density: float = 1000.0
    """[kg/m3]."""
    toughness: float = 20.0
    """Fracture toughness: the energy that a square metre of cut costs [J/m2]."""
    viscous_damping: float = 5.0
    """Drag on every node, as the rate at which its free motion dies away [1/s]."""
    retardation_time: float = 5e-5
    """Penalty-based damping, along springs only: viscosity per stiffness [s] (Kelvin-Voigt)."""
    friction: float = 0.3
    """Coulomb's coefficient of friction where cut faces, pieces and the floor touch. Fresh muscle
    on bone was measured at 0.29 to 0.36 (Shacham, Castel and Gefen 2010); a wet serous skin slips
    more easily."""

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value) or value < 0.0:
                raise ValueError(f"{field.name} is {value}; it must be finite and not negative")
        for name in ("young_modulus", "density"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} is 0; it must be positive")
