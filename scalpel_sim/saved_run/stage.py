"""The part of a recorded run that does not change: what a page draws it with."""

from collections.abc import Sequence
from typing import NamedTuple

from bridge import TissueFrame
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.looks import ORGAN_LOOK, Look, look_of_scene
from scalpel_sim.viewer.model_shapes import Shape, shapes_of
from tissue import FloatArray


class Stage(NamedTuple):
    """The arm and its place, and how the body looks."""

    title: str
    """Heading: the scene and the stroke."""
    shapes: list[Shape]
    """Visible shapes of the arm's model."""
    rotation: FloatArray
    """Axes of the tissue in the world as columns, shape (3, 3)."""
    origin: FloatArray
    """Origin of the tissue in the world [m], shape (3,)."""
    views: Sequence[ViewTable] = ()
    """Cameras of the scene."""
    look: Look = ORGAN_LOOK
    """Look of the body's material."""

    @property
    def frame(self) -> TissueFrame:
        """Pose of the tissue in the world."""
        return TissueFrame(self.rotation, self.origin)


def stage_of(simulation: Simulation, scene: Scene | None) -> Stage:
    """Return the stage of a simulation.

    Args:
        simulation: The simulation.
        scene: Scene that it was made from; None: it is not known.
    """
    return Stage(
        simulation.title,
        list(shapes_of(simulation.arm.model)),
        simulation.frame.rotation,
        simulation.frame.origin,
        () if scene is None else scene.views,
        ORGAN_LOOK if scene is None else look_of_scene(scene),
    )
