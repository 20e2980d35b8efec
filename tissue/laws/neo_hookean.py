"""`NeoHookean`: the stable neo-Hookean law."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from tissue.laws.law import LawKey, Moduli

if TYPE_CHECKING:  # it loads the compiler
    from tissue.laws.energy_density import EnergyDensity


@dataclass(frozen=True)
class NeoHookean:
    """Tetrahedra of a stable neo-Hookean solid (Smith, de Goes and Kim 2018)."""

    name: ClassVar[str] = "neo_hookean"
    keys: ClassVar[Mapping[str, LawKey]] = {}
    stiffens: ClassVar[bool] = False
    has_springs: ClassVar[bool] = False

    def density(self, moduli: Moduli) -> "EnergyDensity":
        """Return the energy density of the tetrahedra."""
        from tissue.laws.energy_density import neo_hookean

        return neo_hookean(moduli.mu, moduli.lam)
