"""The materials that tetrahedra are made of: a table, of which each tetrahedron has a row.

A uniform body has one row. Parts that a cut makes of a tetrahedron have its row, so that nothing
else of a material has to be kept through cuts.
"""

from collections.abc import Sequence
from typing import Self

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.laws.energy_density import EnergyDensity, averaged_shear
from tissue.material import MOST_TERMS, Material

OF_LAW = ("mu", "lam_of_tetrahedra", "lam_of_nodes", "shear_modulus", "excess")
"""Moduli of the energy density [Pa], all of which are in proportion to Young's modulus."""

OF_STIFFENING = ("exponent", "second", "third")
"""Numbers of laws that stiffen."""

SHARES = tuple(f"share_{term + 1}" for term in range(MOST_TERMS))
"""g of the terms of a Prony series."""

TIMES = tuple(f"time_{term + 1}" for term in range(MOST_TERMS))
"""tau of these terms [s]."""

_NO_TERM = (0.0, 1.0)
"""g and tau of a term that a material does not have: nothing relaxes, in any time."""

_OF_FORCES = ("young_modulus", "spring_modulus", "retardation_time")

ELASTIC = (*_OF_FORCES, *OF_LAW, *OF_STIFFENING, *SHARES, *TIMES)
"""Columns from which the forces inside the body follow."""

SCALED: dict[str, tuple[str, ...]] = {
    "young_modulus": ("young_modulus", "spring_modulus", *OF_LAW),
    "density": ("density",),
    "toughness": ("toughness", "skin_toughness", "work_to_rupture"),
    "stiffening": OF_STIFFENING,
    "retardation_time": ("retardation_time",),
    "viscous_damping": ("viscous_damping",),
    "friction": ("friction",),
    "blade_friction": ("blade_friction",),
    "blade_viscosity": ("blade_viscosity",),
}
"""Quantities that a factor can change, by the names of `Material`, and the columns of each."""

OF_ELASTICITY = frozenset({"young_modulus", "density", "stiffening", "retardation_time"})
"""Those of them from which forces inside the body, and masses, follow."""


class MaterialArrays(Arrays):
    """A row for each material, shape (n_materials,) each."""

    is_even: IntCell
    """1 where forces inside the body are those of one material, else 0."""
    has_one_friction: IntCell
    """1 where all have the same coefficient of friction, else 0."""
    has_one_drag: IntCell
    """1 where all have the same drag, else 0."""
    label: IntArray = sized("materials")
    """Label of the tetrahedra: which part of the body they are."""
    young_modulus: FloatArray = sized("materials")
    """Young's modulus [Pa]."""
    poisson_ratio: FloatArray = sized("materials")
    """Poisson's ratio."""
    spring_modulus: FloatArray = sized("materials")
    """Young's modulus in van Gelder's formula [Pa]."""
    density: FloatArray = sized("materials")
    """Density [kg/m3]."""
    toughness: FloatArray = sized("materials")
    """Energy per area of a slow cut by a sharp edge [J/m2]."""
    skin_toughness: FloatArray = sized("materials")
    """The same until the edge has broken the skin [J/m2]."""
    work_to_rupture: FloatArray = sized("materials")
    """Energy per volume of stretching to rupture [J/m3]."""
    retardation_time: FloatArray = sized("materials")
    """Viscosity over stiffness [s]."""
    toughness_exponent: FloatArray = sized("materials")
    """Exponent with which toughness rises with the speed of the cut."""
    toughness_speed: FloatArray = sized("materials")
    """Speed at which toughness is twice that of a slow cut [m/s]."""
    viscous_damping: FloatArray = sized("materials")
    """Drag, as the rate at which slow motion dies away [1/s]."""
    friction: FloatArray = sized("materials")
    """Coefficient of friction between faces of the tissue, and on the floor."""
    blade_friction: FloatArray = sized("materials")
    """Coefficient of friction on the blade."""
    blade_viscosity: FloatArray = sized("materials")
    """Shear stress per sliding speed on the blade [Pa s/m]."""
    mu: FloatArray = sized("materials")
    """`EnergyDensity.mu` [Pa]; 0 where there is none, as of the columns that follow."""
    lam_of_tetrahedra: FloatArray = sized("materials")
    """`EnergyDensity.lam_of_tetrahedra` [Pa]."""
    lam_of_nodes: FloatArray = sized("materials")
    """`EnergyDensity.lam_of_nodes` [Pa]."""
    shear_modulus: FloatArray = sized("materials")
    """`EnergyDensity.shear_modulus` [Pa]."""
    excess: FloatArray = sized("materials")
    """`EnergyDensity.excess` [Pa]."""
    exponent: FloatArray = sized("materials")
    """`EnergyDensity.exponent`."""
    second: FloatArray = sized("materials")
    """`EnergyDensity.second`."""
    third: FloatArray = sized("materials")
    """`EnergyDensity.third`."""
    share_1: FloatArray = sized("materials")
    """g of the first term of the Prony series; 0 where there is none, as of the next two."""
    share_2: FloatArray = sized("materials")
    """g of the second."""
    share_3: FloatArray = sized("materials")
    """g of the third."""
    time_1: FloatArray = sized("materials")
    """tau of the first term [s]."""
    time_2: FloatArray = sized("materials")
    """tau of the second [s]."""
    time_3: FloatArray = sized("materials")
    """tau of the third [s]."""

    @classmethod
    def of(
        cls,
        materials: Sequence[Material],
        labels: Sequence[int],
        *,
        averages_shear: bool = False,
    ) -> Self:
        """Return the table of these materials, each with its label.

        Args:
            materials: The materials.
            labels: Their labels.
            averages_shear: Whether a share of the shear of tetrahedra is averaged around nodes.
        """
        densities = [each.law.density(each.moduli) for each in materials]
        if averages_shear:
            # Springs carry all of the shear themselves.
            densities = [
                averaged_shear(each) if each is not None and each.mu > 0.0 else each
                for each in densities
            ]
        columns = []
        for name in cls.quantities():
            if name in (*OF_LAW, *OF_STIFFENING):
                columns.append([_of_density(density, name) for density in densities])
            elif name in SHARES:
                columns.append([_term(each, SHARES.index(name))[0] for each in materials])
            elif name in TIMES:
                columns.append([_term(each, TIMES.index(name))[1] for each in materials])
            else:
                columns.append([float(getattr(each, name)) for each in materials])
        return cls.of_rows(np.array([labels, *columns], dtype=np.float64).T)

    @classmethod
    def quantities(cls) -> tuple[str, ...]:
        """Return the names of all columns but the label."""
        others = ("is_even", "has_one_friction", "has_one_drag", "label")
        return tuple(name for name in cls.__annotations__ if name not in others)

    @property
    def n(self) -> int:
        """Number of materials."""
        return len(self.label)

    @property
    def wave_speed(self) -> float:
        """Speed of the fastest waves of compression at small strain [m/s]."""
        nu = self.poisson_ratio
        ratio = (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
        return float(np.sqrt(self.young_modulus * ratio / self.density).max())

    @property
    def series(self) -> tuple[FloatArray, FloatArray]:
        """G and tau [s] of each term of each Prony series, shape (n_terms, n_materials).

        There are as many terms as the longest series has.
        """
        shares = np.array([getattr(self, name) for name in SHARES])
        times = np.array([getattr(self, name) for name in TIMES])
        n_terms = int(shares.any(axis=1).sum())
        return shares[:n_terms], times[:n_terms]

    def is_alike(self, other: "MaterialArrays") -> bool:
        """Return whether another table has as many rows, of the same labels, and is as even."""
        cells = all(getattr(self, name) == getattr(other, name) for name in self._cells)
        return cells and np.array_equal(self.label, other.label)

    def take(self, other: "MaterialArrays") -> None:
        """Write the numbers of another table, which `is_alike`, in place of these."""
        for name in self.quantities():
            getattr(self, name)[:] = getattr(other, name)

    def rows(self) -> FloatArray:
        """Return the table as one array, the labels first, shape (n_materials, n_columns)."""
        columns = [self.label.astype(np.float64), *(getattr(self, n) for n in self.quantities())]
        return np.ascontiguousarray(np.stack(columns, axis=1))

    @classmethod
    def of_rows(cls, rows: FloatArray) -> Self:
        """Return the table of which `rows` are the rows."""
        label, *columns = (column.copy() for column in rows.T)
        named = dict(zip(cls.quantities(), columns, strict=True))
        return cls(
            is_even=int(all(_is_one(named[name]) for name in ELASTIC)),
            has_one_friction=int(_is_one(named["friction"])),
            has_one_drag=int(_is_one(named["viscous_damping"])),
            label=label.astype(np.int64),
            **named,
        )


def _is_one(column: FloatArray) -> bool:
    """Return whether all numbers of a column are the same."""
    return bool((column == column[0]).all())


def _term(material: Material, term: int) -> tuple[float, float]:
    """Return g and tau [s] of a term of the Prony series of a material."""
    return material.prony[term] if term < len(material.prony) else _NO_TERM


def _of_density(density: EnergyDensity | None, name: str) -> float:
    return 0.0 if density is None else float(getattr(density, name))
