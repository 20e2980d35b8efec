"""Ids of Gymnasium. The meaning of an id never changes: other numbers get another version."""

import gymnasium

from scalpel_sim.scene.read import TASK_SCENES

NAMESPACE = "scalpel_sim"
"""Namespace of the ids."""

OWN_SCENE = f"{NAMESPACE}/Scene-v0"
"""Id of the environment of any scene: give `scene`."""

_ENTRY_POINT = "scalpel_sim.learning.environment:TissueEnv"
_VECTOR_ENTRY_POINT = "scalpel_sim.learning.vector_env:TissueVectorEnv"


def id_of(task: str) -> str:
    """Return the id of a task: that of `incise_taut-v0` is `scalpel_sim/InciseTaut-v0`."""
    name, version = task.rsplit("-", 1)
    return f"{NAMESPACE}/{''.join(part.capitalize() for part in name.split('_'))}-{version}"


def register_tasks() -> None:
    """Register all ids. Again it does nothing."""
    scenes: dict[str, dict[str, str]] = {OWN_SCENE: {}} | {
        id_of(task): {"scene": task} for task in TASK_SCENES
    }
    for name, given in scenes.items():
        if name not in gymnasium.registry:
            gymnasium.register(
                name, _ENTRY_POINT, vector_entry_point=_VECTOR_ENTRY_POINT, kwargs=given
            )
