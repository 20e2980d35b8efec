"""`Exponential`: Demiray's law of tissue that stiffens as it is stretched."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tissue.laws.law import LawKey, Moduli, check_stiffening

if TYPE_CHECKING:  # it loads the compiler
    from tissue.laws.energy_density import EnergyDensity


@dataclass(frozen=True)
class Exponential:
    """Tetrahedra under an exponential law (Demiray 1972), see `tissue.laws.kernels`.

    Raises:
        ValueError: b is not finite and positive.
    """

    b: float = 0.0
    """Stretched to length 1 + e the modulus is some exp(3 b e^2) times that at rest. Soft organs
    have 5 to 30."""

    name: ClassVar[str] = "exponential"
    keys: ClassVar[Mapping[str, LawKey]] = {"stiffening": LawKey("b")}
    stiffens: ClassVar[bool] = True
    has_springs: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check_stiffening(self)

    def density(self, moduli: Moduli) -> "EnergyDensity":
        """Return the energy density of the tetrahedra."""
        from tissue.laws.energy_density import exponential

        return exponential(moduli.mu, moduli.lam, self.b)
