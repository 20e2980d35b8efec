"""Materials by name: liver, kidney, skin, fat, muscle, gelatin, silicone; with the sources.

Values for soft tissue differ by orders of magnitude between methods of measurement, so each value
states how the tissue was loaded. Values that could not be traced to a measurement are marked.
"""

from typing import Any, NamedTuple

from tissue.material import Material

DAMPING_BAND = (5.0, 1000.0)
"""Band of frequencies [Hz] at both ends of which the presets have their damping ratio, and less
between: from the first bending mode of a palm-sized body to the rate of haptic devices. With an
upper end of 200 Hz the ratio at 20 Hz would be 0.06, not 0.05, and once a cut has made small
tetrahedra a second would take three times the steps."""


class SourcedValue(NamedTuple):
    """A value of a material, and where it comes from."""

    value: float
    """The value in SI units."""
    measured: str
    """How the material was loaded, and the scatter; or why the value was chosen."""
    source: str
    """Publication of the measurement; empty for a choice of ours."""
    is_confirmed: bool = True
    """Whether the value was found in the source. If not, it is an estimate."""


class Preset(NamedTuple):
    """A material by name."""

    name: str
    """Name of the material."""
    about: str
    """Description in a few words."""
    law: str
    """Name of its law."""
    young_modulus: SourcedValue
    """Young's modulus at small strain [Pa]."""
    poisson_ratio: SourcedValue
    """Poisson's ratio."""
    density: SourcedValue
    """Density [kg/m3]."""
    toughness: SourcedValue
    """Fracture toughness [J/m2]."""
    damping_ratio: SourcedValue
    """Damping ratio of bending and stretching at both ends of `DAMPING_BAND`: half the loss
    tangent."""
    blade_friction: SourcedValue
    """Coulomb's coefficient of friction on the steel of a blade."""
    stiffening: SourcedValue | None = None
    """b of the law `exponential`; None under a law without it."""
    yeoh_second: SourcedValue | None = None
    """C20 / C10 of the law `yeoh`; None under a law without it."""
    toughness_exponent: SourcedValue | None = None
    """Exponent with which toughness rises with speed; None where no rise was measured."""
    toughness_speed: SourcedValue | None = None
    """Speed at which toughness is twice that of a slow cut [m/s]; None where no rise was
    measured."""

    @property
    def values(self) -> dict[str, SourcedValue]:
        """The sourced values that this material has, by the names of their fields."""
        fields = self._asdict().items()
        return {name: value for name, value in fields if isinstance(value, SourcedValue)}

    @property
    def material(self) -> Material:
        """The material, as `Tissue` takes it."""
        numbers: dict[str, Any] = {name: sourced.value for name, sourced in self.values.items()}
        del numbers["damping_ratio"]
        plain = Material(law=self.law, **numbers)
        low, high = DAMPING_BAND
        return plain.with_damping(self.damping_ratio.value, low, up_to=high)


ARDA = "Arda et al. 2011, doi:10.2214/AJR.10.5449"
LIU = "Liu et al. 2022, table 2, doi:10.1186/s10033-022-00767-4"
ICRU = "ICRU 46, after PMC4201780, table 1"
WATERY = SourcedValue(
    0.45,
    "chosen: models of soft tissue have 0.45 to 0.4999 (0.49 fits a heel's fat pad best); 0.45 for "
    "the sake of the time step",
    "'Current Poisson's ratio values of finite element models are too low to consider soft tissues "
    "nearly-incompressible: illustration on the human heel region'",
)
LIKE_LIVER = SourcedValue(
    0.17,
    "assumed to be that of liver; soft tissue lies at 0.05 to 0.25",
    "",
    is_confirmed=False,
)
ON_STEEL = SourcedValue(
    0.2,
    "needles in tissue and phantoms: 0.122 to 0.341, less under pressure, more at speed; a sled of "
    "steel on wet bowel 0.007 to 0.054",
    "ASME MSEC 2021, V001T03A008; Tribology Letters 51:377 (2013)",
)
STIFFENING_TISSUE = SourcedValue(
    15.0,
    "chosen for every tissue but fat: b lies between 12 and 33 for human liver in tension, by a "
    "first reading of tests to rupture (40 kPa at 34 %)",
    "Kemper et al. 2010, not confirmed",
    is_confirmed=False,
)
ALKHOULI = "Alkhouli et al. 2013, Am. J. Physiol. Endocrinol. Metab. 305:E1427 (abstract)"
FORTE = (
    "Forte et al. 2015, 'Modelling and experimental characterisation of the rate dependent "
    "fracture properties of gelatine gels' (abstract)"
)
MARECHAL = (
    "Marechal et al., Soft Robotics Materials Database, 'Ecoflex 00-30.csv', "
    "github.com/LucMarechal/Soft-Robotics-Materials-Database"
)
RUBBER_ON_STEEL = SourcedValue(0.2, "assumed to be that of wet tissue", "", is_confirmed=False)

MATERIALS = {
    preset.name: preset
    for preset in (
        Preset(
            "liver",
            "parenchyma of a healthy liver",
            "exponential",
            SourcedValue(
                4.74e3,
                "shear wave elastography in vivo, 115 adults: 4.74 ± 0.91 kPa (2.7 to 7.8)",
                "Dhar et al., Int. J. Med. Res. Rev. (ijmrr 1395)",
            ),
            WATERY,
            SourcedValue(1060.0, "table of tissues", "PMC6925591, table 1"),
            SourcedValue(
                164.0,
                "needles of four diameters, bovine: 164 ± 6 J/m2; porcine: needle 76 to 185, "
                "blade 187 to 225",
                f"Gokgol et al. 2012, doi:10.1016/j.medengphy.2011.09.030; {LIU}",
            ),
            SourcedValue(
                0.17,
                "magnetic resonance elastography in vivo, 8 adults: a standard linear solid of "
                "1.16 and 1.97 kPa and 7.3 Pa s has a loss tangent of 0.35 at 10 Hz",
                "Asbach et al. 2008, Magn. Reson. Med. 60:373",
            ),
            ON_STEEL,
            STIFFENING_TISSUE._replace(
                measured="chosen: b lies between 12 and 33 in tension, human, by a first reading "
                "of tests to rupture (40 kPa at 34 %). In compression at most 7: 36 human "
                "specimens broke at 38.9 to 145.9 kPa and strains of 0.48 to 1.15",
                source="Kemper et al. 2010, not confirmed; Kemper and Duma 2013, "
                "doi:10.1115/1.4024821 (abstract)",
            ),
        ),
        Preset(
            "kidney",
            "cortex of a healthy kidney",
            "exponential",
            SourcedValue(5.0e3, "shear wave elastography in vivo, 127 adults: 5.0 ± 2.9 kPa", ARDA),
            WATERY,
            SourcedValue(
                1050.0, "table of tissues", "Mech. Mater. 2012, table 3", is_confirmed=False
            ),
            SourcedValue(164.0, "no measurement found: that of liver", "", is_confirmed=False),
            LIKE_LIVER,
            ON_STEEL,
            STIFFENING_TISSUE,
        ),
        Preset(
            "skin",
            "dermis and epidermis as one",
            "exponential",
            SourcedValue(
                100e3,
                "chosen between in vivo shear wave elastography (forearm 14.8 kPa, 3.5 to 26) and "
                "tension of 56 excised samples of the back (at first 1.18 ± 0.88 MPa, 21.6 ± 8.4 "
                "MPa at rupture at 54 ± 17 %); 5 kPa to 140 MPa are reported",
                "Yang et al. 2018 (90 adults); Ní Annaidh et al. 2012, "
                "doi:10.1016/j.jmbbm.2011.08.016 (abstract); Kalra et al. 2016, Mechanical "
                "behaviour of skin",
                is_confirmed=False,
            ),
            WATERY,
            SourcedValue(1100.0, "table of tissues", ICRU),
            SourcedValue(
                1136.0,
                "needle, porcine; scissors 1700 (rat) and 2800 (chicken); tearing 17,000 to 30,000",
                LIU,
            ),
            LIKE_LIVER,
            ON_STEEL,
            STIFFENING_TISSUE,
        ),
        Preset(
            "fat",
            "fat below the skin",
            "exponential",
            SourcedValue(
                26.1e3,
                "compression under a probe at 1 N, gluteal, 21 men: 26.1 ± 19.0 kPa; at 30 N "
                "2,200 kPa. Unloaded far less: in tension, excised, 1.6 ± 0.8 kPa; by magnetic "
                "resonance elastography at 50 Hz, 10 women, 3 x 0.75 kPa",
                f"Isogai et al. 2022, doi:10.1589/jpts.34.777; {ALKHOULI}; 'Strain-dependent shear "
                "properties of human adipose tissue in vivo', J. Mech. Behav. Biomed. Mater. 2023 "
                "(abstract)",
            ),
            WATERY,
            SourcedValue(950.0, "table of tissues", ICRU),
            SourcedValue(
                200.0,
                "no measurement with a blade found: that of liver; tearing takes 4100 (porcine)",
                LIU,
                is_confirmed=False,
            ),
            LIKE_LIVER,
            ON_STEEL,
            SourcedValue(
                6.8,
                "tension of excised subcutaneous fat, 44 patients: the slope rises from 1.6 ± 0.8 "
                "to 11.7 ± 6.4 kPa at 30 %, as that of a bar with this b and a Poisson's ratio of "
                "0.45 does; omental fat from 2.9 ± 1.5 to 32 ± 15.6 kPa, which is a b of 10",
                ALKHOULI,
            ),
        ),
        Preset(
            "muscle",
            "skeletal muscle at rest, as if it were the same in all directions",
            "exponential",
            SourcedValue(
                11.1e3,
                "shear wave elastography in vivo, gastrocnemius, 127 adults: 11.1 ± 4.1 kPa; "
                "compression at 5 N (gluteal) 62 ± 10 kPa",
                f"{ARDA}; Isogai et al. 2022, doi:10.1589/jpts.34.777",
            ),
            WATERY,
            SourcedValue(1050.0, "table of tissues", ICRU),
            SourcedValue(
                550.0,
                "notched tension, porcine: 550 to 8000, the lowest taken; such tests of muscle "
                "found its strength rather than its toughness",
                f"{LIU}; Taylor et al. 2012 (abstract)",
            ),
            LIKE_LIVER,
            ON_STEEL,
            STIFFENING_TISSUE._replace(
                measured="that of liver; in compression in vivo muscle hardly stiffens, 10 women: "
                "a b of about 1",
                source="'Strain-dependent shear properties of human adipose tissue in vivo', J. "
                "Mech. Behav. Biomed. Mater. 2023 (abstract)",
            ),
        ),
        Preset(
            "gelatin",
            "gelatin of 10 % by weight, a common phantom",
            "neo_hookean",
            SourcedValue(
                18.3e3,
                "fast compression; a power law between 277 ± 30 kPa (2 parts of water to 1 of "
                "powder) and 4.34 ± 0.64 kPa (20 parts), at 9 parts",
                "Bonavia 2025, arXiv:2512.20502",
            ),
            WATERY,
            SourcedValue(
                1027.0, "computed from water and protein of 1350 kg/m3", "", is_confirmed=False
            ),
            SourcedValue(1.1, "wire cutting, 10 % by weight: some 1.1 J/m2 up to 10 mm/min", FORTE),
            SourcedValue(
                0.04,
                "shear between plates, a softer gel: loss tangent 0.06 to 0.14, 20 to 200 Hz",
                "Okamoto et al. 2011",
            ),
            ON_STEEL,
            toughness_exponent=SourcedValue(
                0.5,
                "wire cutting above 10 mm/min: the logarithms of toughness and of speed have a "
                "slope of 0.5; up to which speed is not said",
                FORTE,
            ),
            toughness_speed=SourcedValue(
                10e-3 / 60.0,
                "10 mm/min, where the rise begins: the law adds both parts, and lies 10 % above "
                "the measured line at 1,000 mm/min, 5 % at 60 mm/s",
                FORTE,
            ),
        ),
        Preset(
            "silicone",
            "platinum-cured silicone of Shore 00-30",
            "yeoh",
            SourcedValue(
                46.4e3,
                "tension of one dumbbell (ASTM D412, 450 mm/min, strain from the grips): fitted by "
                "us with C20 / C10 to its curve from 25 to 800 %, which it meets within 4 % from "
                "50 % on; the data sheet has 69 kPa at 100 %, the curve 30 kPa",
                MARECHAL,
            ),
            SourcedValue(0.45, "chosen: rubber keeps its volume; 0.45 for the time step", ""),
            SourcedValue(
                1070.0, "specific gravity", "data sheet of Ecoflex 00-30", is_confirmed=False
            ),
            SourcedValue(
                300.0,
                "notched tension of a plain silicone network: some 300 J/m2; commercial grades "
                "with filler tear at ten times as much",
                "PNAS 2019, PMC6442615",
                is_confirmed=False,
            ),
            SourcedValue(
                0.02,
                "5 % of the work of a cycle is lost: a loss tangent of some 0.03",
                "PNAS 2019, PMC6442615",
                is_confirmed=False,
            ),
            RUBBER_ON_STEEL,
            yeoh_second=SourcedValue(0.0093, "fitted with Young's modulus to one curve", MARECHAL),
        ),
    )
}
"""The materials by name."""
