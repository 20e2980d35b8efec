"""`MassSpring`: springs along the edges, as in the paper."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tissue.laws.law import LawKey, Moduli, check_parameters

if TYPE_CHECKING:  # it loads the compiler
    from tissue.laws.energy_density import EnergyDensity


@dataclass(frozen=True)
class MassSpring:
    """Springs along the edges; above a Poisson's ratio of 1/4 tetrahedra keep the volume.

    Raises:
        ValueError: the calibration is not finite and positive.
    """

    calibration: float = 1.0
    """Stiffness of the springs over that of van Gelder's formula: 1, unless the mesh was calibrated
    (`tissue.calibrated`)."""

    name: ClassVar[str] = "springs"
    keys: ClassVar[Mapping[str, LawKey]] = {
        "spring_calibration": LawKey("calibration", neutral=1.0)
    }
    stiffens: ClassVar[bool] = False
    has_springs: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_parameters(self)
        if self.calibration == 0.0:
            raise ValueError("spring_calibration is 0; it must be positive")

    def density(self, moduli: Moduli) -> "EnergyDensity | None":
        """Return the energy density of what springs leave to tetrahedra; None for nothing."""
        from tissue.laws.energy_density import volume_term

        return volume_term(moduli.volume) if moduli.volume > 0.0 else None
