"""`Yeoh`: the polynomial of third order of tissue that stiffens as it is stretched."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tissue.laws.law import LawKey, Moduli, check_stiffening

if TYPE_CHECKING:  # it loads the compiler
    from tissue.laws.energy_density import EnergyDensity


@dataclass(frozen=True)
class Yeoh:
    """Tetrahedra under a polynomial of third order (Yeoh 1990), see `tissue.laws.kernels`.

    Raises:
        ValueError: a ratio is not finite and at least 0, or both are 0.
    """

    c2: float = 0.0
    """C20 / C10, in the notation of Yeoh's paper."""
    c3: float = 0.0
    """C30 / C10."""

    name: ClassVar[str] = "yeoh"
    keys: ClassVar[Mapping[str, LawKey]] = {
        "yeoh_second": LawKey("c2"),
        "yeoh_third": LawKey("c3"),
    }
    stiffens: ClassVar[bool] = True
    has_springs: ClassVar[bool] = False

    def __post_init__(self) -> None:
        check_stiffening(self)

    def density(self, moduli: Moduli) -> "EnergyDensity":
        """Return the energy density of the tetrahedra."""
        from tissue.laws.energy_density import polynomial

        return polynomial(moduli.mu, moduli.lam, self.c2, self.c3)
