"""The scenes of the validation, in the order in which they are reported."""

from collections.abc import Callable, Sequence

from scalpel_sim.errors import unknown
from scalpel_sim.validate.audit import measure_audit
from scalpel_sim.validate.beam import measure_beam
from scalpel_sim.validate.contact import measure_contact
from scalpel_sim.validate.coupling import measure_coupling
from scalpel_sim.validate.findings import Findings, ValidationScene, sections
from scalpel_sim.validate.gel import measure_gel
from scalpel_sim.validate.incision import measure_incision
from scalpel_sim.validate.liver import measure_liver
from scalpel_sim.validate.measured.curves import measure_tissue_curves
from scalpel_sim.validate.measured.silicone_bar import measure_silicone_bar
from scalpel_sim.validate.puncture import measure_puncture
from scalpel_sim.validate.rate import measure_rate
from scalpel_sim.validate.reaction import measure_reaction
from scalpel_sim.validate.slicing import measure_slicing
from scalpel_sim.validate.spine import measure_spine
from scalpel_sim.validate.steady import measure_steady
from scalpel_sim.validate.stretch import measure_stretch, measure_tension
from scalpel_sim.validate.symmetry import measure_symmetry

_MEASURES: dict[str, Callable[[bool], Findings]] = {
    "audit": measure_audit,
    "beam": measure_beam,
    "contact": measure_contact,
    "coupling": measure_coupling,
    "gel": measure_gel,
    "incision": measure_incision,
    "liver": measure_liver,
    "puncture": measure_puncture,
    "rate": measure_rate,
    "reaction": measure_reaction,
    "silicone_bar": measure_silicone_bar,
    "slicing": measure_slicing,
    "spine": measure_spine,
    "steady": measure_steady,
    "stretch": measure_stretch,
    "symmetry": measure_symmetry,
    "tension": measure_tension,
    "tissue_curves": measure_tissue_curves,
}

VALIDATION_SCENES: dict[str, ValidationScene] = {
    name: ValidationScene(name, each.title, each.about, _MEASURES[name], each.references)
    for name, each in sections().items()
}


def chosen_scenes(names: Sequence[str]) -> list[ValidationScene]:
    """Return the scenes of those names; all of them where no name is given.

    Raises:
        UsageError: there is no scene of that name; the message lists those that there are.
    """
    for name in names:
        if name not in VALIDATION_SCENES:
            raise unknown("scene of the validation", name, VALIDATION_SCENES)
    return [scene for scene in VALIDATION_SCENES.values() if not names or scene.name in names]
