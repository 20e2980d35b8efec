"""`Law`: the protocol of a law of elasticity, and the keys of its parameters."""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, NamedTuple, Protocol

if TYPE_CHECKING:  # it loads the compiler
    from tissue.laws.energy_density import EnergyDensity


class Moduli(NamedTuple):
    """Moduli of a material at small strain."""

    mu: float
    """Lame's second constant, the shear modulus [Pa]."""
    lam: float
    """Lame's first constant [Pa]."""
    volume: float
    """lam - mu [Pa], exactly 0 at a Poisson's ratio of 1/4: what springs leave to tetrahedra."""


class LawKey(NamedTuple):
    """A parameter of a law under the name that keywords of `Material` and files have for it."""

    field: str
    """Name of the parameter in the class of the law."""
    neutral: float = 0.0
    """Value under laws that do not have the parameter."""


class Law(Protocol):
    """A law of elasticity: a frozen dataclass whose fields are its parameters."""

    name: ClassVar[str]
    """Name in files and messages."""
    keys: ClassVar[Mapping[str, LawKey]]
    """The parameters, by the names that files have for them."""
    stiffens: ClassVar[bool]
    """Whether tissue gets stiffer as it is stretched. Such a law needs relaxation `global`."""
    has_springs: ClassVar[bool]
    """Whether springs along the edges carry the shear."""

    def density(self, moduli: Moduli) -> "EnergyDensity | None":
        """Return the energy density of the tetrahedra; None where springs alone are elastic.

        Args:
            moduli: The moduli at small strain, which the law must have.
        """


def check_parameters(law: Law) -> None:
    """Check that every parameter of a law is finite and not negative.

    Raises:
        ValueError: one is not; the message names it as files do.
    """
    for name, key in law.keys.items():
        value = getattr(law, key.field)
        if not math.isfinite(value) or value < 0.0:
            raise ValueError(f"{name} is {value}; it must be finite and not negative")


def check_stiffening(law: Law) -> None:
    """Check the parameters of a law that stiffens, one of which is positive.

    Raises:
        ValueError: a parameter is wrong, or all are 0.
    """
    check_parameters(law)
    if not any(getattr(law, key.field) for key in law.keys.values()):
        raise ValueError(
            f"law {law.name} without stiffening: {' or '.join(law.keys)} must be positive. "
            "Tissue that does not stiffen has law neo_hookean"
        )
