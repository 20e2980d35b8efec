"""Silicone against a published curve: a bar is pulled to six times its length."""

import numpy as np

from scalpel_sim.validate.findings import (
    PUBLISHED,
    Check,
    Curve,
    Findings,
    Plot,
    Reference,
    ValidationScene,
    within,
)
from scalpel_sim.validate.stretch import stretched_bar
from tissue import MATERIALS

MEASURED = {
    0.5: 16.89e3,
    1.0: 29.72e3,
    1.5: 40.08e3,
    2.0: 52.39e3,
    2.5: 65.93e3,
    3.0: 80.15e3,
    3.5: 96.46e3,
    4.0: 114.76e3,
    4.5: 134.15e3,
    5.0: 156.68e3,
}
"""Strain of Ecoflex 00-30, and force over the section at rest [Pa]: the rows of the file at these
strains."""

_NEAR = 0.05
"""Largest relative error of a point. One specimen was pulled: what others would scatter by is not
in the file, and neighbouring rows of it by 2 %."""


def _measure(quick: bool) -> Findings:
    """Pull a bar of silicone, and compare it with the curve at each of its points."""
    found = stretched_bar(MATERIALS["silicone"].material, longest=1.0 + max(MEASURED))
    measured = np.array(list(MEASURED.values()))
    checks = [
        Check(f"silicone, longer by {strain:.0%}: force / measured force", ours / published,
              *within(_NEAR), basis=PUBLISHED)
        for strain, ours, published in zip(MEASURED, found.stress, measured, strict=True)
    ]  # fmt: skip
    curves = [
        Curve("simulated", found.stretch - 1.0, found.stress * 1e-3),
        Curve("measured", np.array(list(MEASURED)), measured * 1e-3, is_theory=True),
    ]
    plot = Plot("Ecoflex 00-30 in tension", "strain", "force / section at rest [kPa]", curves)
    return Findings(checks, [plot])


TENSION_SCENE = ValidationScene(
    name="tension",
    title="A published curve: silicone in tension",
    about=(
        "A bar of the material silicone is pulled to six times its length, and its force is "
        "compared with that of a published curve at ten points. Two numbers of the material, "
        "Young's modulus and C20 / C10, were fitted to this curve, to 800 %; that ten points lie "
        "on it says that the law has the shape of the curve, and that the engine follows the law. "
        "Below 50 % the curve is up to an eighth lower: its strain is that of the grips, and its "
        "force begins below zero. The maker's data sheet has twice the stress at 100 %. The bar "
        "has the preset's own 46.4 kPa."
    ),
    measure=_measure,
    references=[
        Reference(
            "Marechal et al., Soft Robotics Materials Database, 'Tensile-Tests-Data/Ecoflex "
            "00-30.csv', github.com/LucMarechal/Soft-Robotics-Materials-Database",
            "Ecoflex 00-30, a dumbbell of 33 x 6 x 3 mm after ASTM D412, pulled at 450 mm/min "
            "until it breaks; strain and stress every 0.1 s",
        ),
    ],
)
