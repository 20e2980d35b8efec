"""The scenes of the validation, in the order in which they are reported."""

from collections.abc import Sequence

from scalpel_sim.errors import unknown
from scalpel_sim.validate.audit import AUDIT_SCENE
from scalpel_sim.validate.beam import BEAM_SCENE
from scalpel_sim.validate.contact import CONTACT_SCENE
from scalpel_sim.validate.coupling import COUPLING_SCENE
from scalpel_sim.validate.findings import ValidationScene
from scalpel_sim.validate.gel import GEL_SCENE
from scalpel_sim.validate.incision import INCISION_SCENE
from scalpel_sim.validate.liver import LIVER_SCENE
from scalpel_sim.validate.puncture import PUNCTURE_SCENE
from scalpel_sim.validate.rate import RATE_SCENE
from scalpel_sim.validate.reaction import REACTION_SCENE
from scalpel_sim.validate.slicing import SLICING_SCENE
from scalpel_sim.validate.spine import SPINE_SCENE
from scalpel_sim.validate.steady import STEADY_SCENE
from scalpel_sim.validate.stretch import STRETCH_SCENE, TENSION_SCENE
from scalpel_sim.validate.symmetry import SYMMETRY_SCENE

VALIDATION_SCENES: dict[str, ValidationScene] = {
    scene.name: scene
    for scene in (
        BEAM_SCENE,
        STRETCH_SCENE,
        STEADY_SCENE,
        SYMMETRY_SCENE,
        RATE_SCENE,
        SLICING_SCENE,
        PUNCTURE_SCENE,
        SPINE_SCENE,
        REACTION_SCENE,
        CONTACT_SCENE,
        AUDIT_SCENE,
        COUPLING_SCENE,
        LIVER_SCENE,
        INCISION_SCENE,
        GEL_SCENE,
        TENSION_SCENE,
    )
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
