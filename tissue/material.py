"""The material of the tissue, in quantities that can be measured."""

import inspect
import logging
import math
from collections.abc import Iterable, Mapping
from dataclasses import InitVar, dataclass, fields, replace
from typing import Any

from tissue.laws import LAWS
from tissue.laws.law import Law, Moduli
from tissue.laws.mass_spring import MassSpring
from tissue.laws.neo_hookean import NeoHookean

CENTRAL_FORCE_RATIO = 0.25
"""Poisson's ratio of an isotropic network of springs: forces along the lines between nodes make
both of Lame's constants the same (Cauchy's relation), whatever the stiffnesses."""

NEARLY_INCOMPRESSIBLE = 0.49
"""Poisson's ratio above which the time step gets very short: waves of compression are
sqrt(1 / (1 - 2 nu)) times as fast, 7 times at 0.49, and an explicit step must resolve them."""


MOST_TERMS = 3
"""Terms of a Prony series at most: each costs memory and time, and a relaxation test of five
decades of time is fitted by three."""

SHORTEST_RELAXATION = 0.01
"""Shortest time constant of a Prony series [s]: ten steps of 1 ms, which resolve it. Damping is for
what is faster."""

_OF_LAWS = ("stiffening", "yeoh_second", "yeoh_third", "spring_calibration")
"""Keywords of `Material` for parameters of laws, in their order."""

_log = logging.getLogger("tissue")


class _LawOrName:
    """The field `law` of a material: set to a law or the name of one, read as a law."""

    def __get__(self, material: "Material | None", owner: type) -> Law:
        if material is None:  # the default
            return NeoHookean()
        law: Law = vars(material)["_law"]
        return law

    def __set__(self, material: "Material", law: Law | str) -> None:
        vars(material)["_law"] = law


@dataclass(frozen=True)
class Material:
    """An isotropic soft tissue.

    The law is one of `tissue.LAWS` or of your own, `law=Exponential(5.0)`, or the name of a law
    with its parameters as keywords, `law="exponential", stiffening=5.0`.

    Raises:
        ValueError: a quantity is not finite, has the wrong sign, or is impossible under the law.
    """

    young_modulus: float = 10e3
    """Stiffness at small strain [Pa]."""
    density: float = 1000.0
    """Density [kg/m3]."""
    toughness: float = 20.0
    """Fracture toughness: energy per area of cut [J/m2]."""
    skin_toughness: float = 0.0
    """Energy per area of cut until the edge has broken the skin [J/m2]: the peak of a puncture.
    Values below `toughness` count as equal to it: no peak."""
    toughness_exponent: float = 0.0
    """Exponent n with which toughness rises with the speed v of the cut, toughness (1 + (v /
    toughness_speed)^n); 0 for a toughness that does not depend on speed."""
    toughness_speed: float = 0.1
    """Speed at which toughness is twice that of a slow cut [m/s]; no effect if the exponent is
    0."""
    work_to_rupture: float = 0.0
    """Energy per volume that stretching to rupture takes [J/m3]; with a blunt edge it adds to the
    toughness (`tissue.blade_shape.BladeShape.edge_radius`)."""
    blade_friction: float = 0.0
    """Coulomb's coefficient of friction on the faces of the blade, static and sliding."""
    blade_viscosity: float = 0.0
    """Shear stress per sliding speed on the faces of the blade, added to friction [Pa s/m]."""
    viscous_damping: float = 5.0
    """Drag, as the rate at which slow motion within the tissue decays [1/s]. A loose piece falls
    and turns freely: drag acts on its motion less the rigid part, see
    `tissue.forces.rigid_motion`."""
    retardation_time: float = 5e-5
    """Viscosity over stiffness at small strain [s] (Kelvin-Voigt): of tetrahedra in shear and in
    volume, of springs along the edges, where the volume term has none."""
    friction: float = 0.3
    """Coulomb's coefficient of friction where cut faces, pieces and the floor touch. Fresh muscle
    on bone was measured at 0.29 to 0.36 (Shacham, Castel and Gefen 2010); a wet serous skin slips
    more easily."""
    law: _LawOrName = _LawOrName()
    """Law by which forces follow from deformation."""
    poisson_ratio: float = 0.45
    """Transverse contraction over extension. Springs alone have 1/4; for more each tetrahedron also
    resists a change of its volume, and less is impossible with springs. Soft tissue is mostly water
    and barely compressible: 0.45 to 0.49."""
    stiffening: InitVar[float | None] = None
    """`Exponential.b`, where the law is given by name; read it from the law. So the next three."""
    yeoh_second: InitVar[float | None] = None
    """`Yeoh.c2`."""
    yeoh_third: InitVar[float | None] = None
    """`Yeoh.c3`."""
    spring_calibration: InitVar[float | None] = None
    """`MassSpring.calibration`."""
    prony: tuple[tuple[float, float], ...] = ()
    """Relaxation of stress, as g and tau [s] of one to three terms; none: no stress relaxes. Held
    tissue keeps G(t) = 1 - sum of g (1 - exp(-t / tau)) of its stress (Fung's quasi-linear
    viscoelasticity, `tissue.elasticity.viscoelasticity`). `young_modulus` and the other stiffnesses
    are those of fast motion."""

    def __post_init__(self, *of_law: float | None) -> None:
        given = zip(_OF_LAWS, of_law, strict=True)
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name not in ("law", "prony") and (not math.isfinite(value) or value < 0.0):
                raise ValueError(f"{field.name} is {value}; it must be finite and not negative")
        for name in ("young_modulus", "density", "toughness_speed"):
            if getattr(self, name) == 0.0:
                raise ValueError(f"{name} is 0; it must be positive")
        parameters = {name: value for name, value in given if value is not None}
        object.__setattr__(self, "law", law_with(self.law, parameters))
        self._check_ratio()
        object.__setattr__(self, "prony", checked_series(self.prony))
        if self.prony and self.law.has_springs:
            raise ValueError(
                "prony is given with law springs, whose stress does not relax: leave it out, or "
                "choose law neo_hookean, exponential or yeoh"
            )

    def _check_ratio(self) -> None:
        """Refuse a Poisson's ratio that is impossible under the law."""
        ratio = self.poisson_ratio
        if ratio >= 0.5:
            raise ValueError(
                f"poisson_ratio is {ratio}; it must be below 0.5, where no force changes the "
                "volume and no time step is short enough. Soft tissue is simulated at 0.45 to 0.49"
            )
        if self.law.has_springs and ratio < CENTRAL_FORCE_RATIO:
            raise ValueError(
                f"poisson_ratio is {ratio}; springs act along the lines between nodes, and such "
                "a body has at least 0.25. Use law neo_hookean, which allows 0 to below 0.5"
            )

    def changed(self, **changes: Any) -> "Material":
        """Return the material with some quantities replaced, or parameters of its law.

        Another law drops the parameters of the law before.

        Raises:
            TypeError: there is no such quantity.
            ValueError: as for a new material.
        """
        law = changes.pop("law", self.law)
        if law == self.law.name:
            law = self.law
        keys = {key for kind in LAWS.values() for key in kind.keys} | self.law.keys.keys()
        parameters = {key: changes.pop(key) for key in keys & changes.keys()}
        return replace(self, law=law_with(law, parameters), **changes)

    @classmethod
    def of_keys(cls, keys: Mapping[str, Any]) -> "Material":
        """Return the material of the quantities that `as_keys` returns, or of some of them.

        Raises:
            TypeError: there is no such quantity.
            ValueError: as for a new material.
        """
        return cls().changed(**keys)

    def as_keys(self) -> dict[str, Any]:
        """Return what decides the material, by the names that files have.

        The law is given by its name, and its parameters as numbers; those that only other laws
        have are neutral.
        """
        neutral = {name: key.neutral for kind in LAWS.values() for name, key in kind.keys.items()}
        own = {name: getattr(self.law, key.field) for name, key in self.law.keys.items()}
        of_law = neutral | own | {"law": self.law.name}
        names = inspect.signature(Material).parameters
        quantities = {name: getattr(self, name) for name in names if name not in of_law}
        return {name: (of_law | quantities)[name] for name in [*names, *of_law]}

    @property
    def stiffens(self) -> bool:
        """Whether it gets stiffer as it is stretched."""
        return self.law.stiffens

    @property
    def moduli(self) -> Moduli:
        """The moduli at small strain."""
        return Moduli(self.mu, self.lam, self.volume_modulus)

    @property
    def mu(self) -> float:
        """Lame's second constant, the shear modulus at small strain [Pa]."""
        return self.young_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def lam(self) -> float:
        """Lame's first constant at small strain [Pa]."""
        nu = self.poisson_ratio
        return self.young_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    @property
    def spring_modulus(self) -> float:
        """Young's modulus E in van Gelder's formula k = E V / l^2 [Pa], of springs and of dampers.

        Springs of that stiffness are, on average over all directions, a body with both of Lame's
        constants 0.4 E. So 2.5 mu gives the body its shear modulus; at a Poisson's ratio of 1/4 it
        is Young's modulus, and above that `volume_modulus` adds what is missing.
        """
        calibration = self.law.calibration if isinstance(self.law, MassSpring) else 1.0
        return 2.5 * self.mu * calibration

    @property
    def volume_modulus(self) -> float:
        """Stiffness against change of volume that tetrahedra add to springs [Pa]: lam - mu.

        0 at a Poisson's ratio of 1/4, negative below it, where law springs is refused. Source:
        Golec et al. 2020 (hybrid mass-spring system with a volume term).
        """
        nu = self.poisson_ratio  # exactly 0 at 1/4, which lam - mu would miss by rounding
        return self.young_modulus * (4.0 * nu - 1.0) / (2.0 * (1.0 + nu) * (1.0 - 2.0 * nu))

    @property
    def wave_speed(self) -> float:
        """Speed of waves of compression, the fastest there are at small strain [m/s]."""
        return math.sqrt((self.lam + 2.0 * self.mu) / self.density)

    def damping_ratio(self, frequency: float) -> float:
        """Return the damping ratio of a bending or stretching mode of that frequency [Hz].

        It is half the loss tangent that a rheometer measures at that frequency. Drag dominates at
        low frequencies, viscosity at high ones.
        """
        omega = 2.0 * math.pi * frequency
        return self.viscous_damping / (2.0 * omega) + omega * self._retardation_in_tension / 2.0

    def with_damping(
        self, ratio: float, frequency: float, up_to: float | None = None
    ) -> "Material":
        """Return this material with the damping ratio `ratio` at `frequency` [Hz], and at `up_to`.

        A ratio of 1 is critical: the body returns without oscillating. Choose the body's first
        bending mode for `frequency`. The loss tangent of soft tissue, twice the damping ratio,
        barely depends on frequency. Damping by viscosity rises with frequency, damping by drag
        falls; their sum is `ratio` at both ends of a band and less between them (Rayleigh).

        Args:
            ratio: Damping ratio of bending and stretching.
            frequency: Lower end of the band [Hz].
            up_to: Upper end of the band [Hz], or None to omit drag: then the ratio is proportional
            to
                frequency. A high end costs nothing. With a low one, or None, the viscosity of fine
                meshes makes the time step short.

        Raises:
            ValueError: the ratio is negative or not finite, a frequency is not positive, or the
                band ends before it begins.
        """
        if not (math.isfinite(ratio) and ratio >= 0.0):
            raise ValueError(f"damping ratio is {ratio}; it must be finite and not negative")
        if not (math.isfinite(frequency) and frequency > 0.0):
            raise ValueError(f"frequency is {frequency} Hz; it must be positive")
        if up_to is not None and not (math.isfinite(up_to) and up_to > frequency):
            raise ValueError(f"up_to is {up_to} Hz; it must be above frequency, {frequency} Hz")
        low = 2.0 * math.pi * frequency
        high = 0.0 if up_to is None else 2.0 * math.pi * up_to
        in_tension = 2.0 * ratio / (low + high)
        return replace(
            self,
            viscous_damping=in_tension * low * high,
            retardation_time=in_tension * self._shear_per_tension,
        )

    @property
    def _retardation_in_tension(self) -> float:
        """Viscosity over stiffness of a bar that is pulled or bent [s]."""
        return self.retardation_time / self._shear_per_tension

    @property
    def _shear_per_tension(self) -> float:
        """Retardation time in shear over that of a bar that is pulled or bent.

        Of tetrahedra both are the same. Dampers along edges in all directions are a body with both
        of Lame's constants mu per second of retardation time. In a bar that narrows by nu times as
        much as it is stretched they have viscosity (3 - 4 nu + 8 nu^2) mu per second, and its
        Young's modulus is 2 (1 + nu) mu.
        """
        if not self.law.has_springs:
            return 1.0
        nu = self.poisson_ratio
        return 2.0 * (1.0 + nu) / (3.0 - 4.0 * nu + 8.0 * nu * nu)


def law_with(law: Law | str, parameters: dict[str, float]) -> Law:
    """Return a law with some of its parameters replaced, or the law of a name.

    Args:
        law: The law, or its name.
        parameters: Values by the names that files have for them. Those of other laws are neutral.

    Raises:
        ValueError: no law has the name, a parameter is not one of the law, or is impossible.
    """
    if isinstance(law, str):
        if law not in LAWS:
            raise ValueError(f"no law is called {law!r}. Known: {', '.join(LAWS)}")
        kind, own = LAWS[law], {}
    else:
        kind, own = type(law), {key.field: getattr(law, key.field) for key in law.keys.values()}
    for name, value in parameters.items():
        if name in kind.keys:
            own[kind.keys[name].field] = value
        else:
            _expect_neutral(kind.name, name, value)
    return kind(**own)


def _expect_neutral(law: str, name: str, value: float) -> None:
    """Check that a parameter which a law does not have says nothing.

    Raises:
        ValueError: it does.
    """
    kind = next(kind for kind in LAWS.values() if name in kind.keys)
    neutral = kind.keys[name].neutral
    if value != neutral:
        raise ValueError(
            f"{name} is {value} with law {law}, which does not have it: leave it at "
            f"{neutral:g}, or choose law {kind.name}"
        )


def checked_series(series: Iterable[Iterable[float]]) -> tuple[tuple[float, float], ...]:
    """Return the terms of a Prony series as pairs of numbers, g and tau [s].

    Raises:
        ValueError: it is no series of such pairs, has too many terms, a g that is not between 0 and
            1, or g whose sum is not, or a tau that is too short.
    """
    try:
        terms = [tuple(float(number) for number in term) for term in series]
        pairs = tuple((share, time) for share, time in terms)
    except (TypeError, ValueError) as error:
        raise ValueError(f"prony is {series}; it must be pairs of numbers, g and tau") from error
    if len(pairs) > MOST_TERMS:
        raise ValueError(f"prony has {len(pairs)} terms; it may have {MOST_TERMS} at most")
    for share, time in pairs:
        if not 0.0 < share < 1.0:
            raise ValueError(f"prony has a g of {share}; it must be between 0 and 1")
        if not (math.isfinite(time) and time >= SHORTEST_RELAXATION):
            raise ValueError(
                f"prony has a tau of {time} s; it must be finite and at least "
                f"{SHORTEST_RELAXATION} s. What relaxes faster is damping: retardation_time"
            )
    total = sum(share for share, _ in pairs)
    if not total < 1.0:
        raise ValueError(
            f"prony has g whose sum is {total:g}; it must be below 1, or nothing of the stress is "
            "left finally"
        )
    return pairs


def warn_of_ratio(material: Material) -> None:
    """Log a warning if the resistance to compression makes time steps very short."""
    ratio = material.poisson_ratio
    if ratio > NEARLY_INCOMPRESSIBLE:
        _log.warning(
            "poisson_ratio is %g: time steps are %.3g times shorter than at 0.45, because waves of "
            "compression are that much faster. 0.45 to 0.49 is as incompressible as a soft body "
            "looks",
            ratio,
            material.wave_speed / replace(material, poisson_ratio=0.45).wave_speed,
        )
