"""The scenes of the validation, in the order in which they are reported."""

from collections.abc import Sequence

from scalpel_sim.errors import unknown
from scalpel_sim.validate import (
    audit,
    coupling,
    gel,
    liver,
    puncture,
    rate,
    reaction,
    slicing,
    steady,
    symmetry,
)
from scalpel_sim.validate.findings import Scene

SCENES: dict[str, Scene] = {
    module.SCENE.name: module.SCENE
    for module in (steady, symmetry, rate, slicing, puncture, reaction, audit, coupling, liver, gel)
}


def chosen(names: Sequence[str]) -> list[Scene]:
    """Return the scenes of those names; all of them where there is no name.

    Raises:
        UsageError: there is none of that name; the message says which there are.
    """
    for name in names:
        if name not in SCENES:
            raise unknown("scene of the validation", name, SCENES)
    return [scene for scene in SCENES.values() if not names or scene.name in names]
