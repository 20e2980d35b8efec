"""Models and tissue that cameras see."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import mujoco

from bridge import InProcessLink, TissueFrame, TissueLink
from scalpel_sim.arm.blade import Blade
from scalpel_sim.arm.grasper import Grasper
from scalpel_sim.camera.pen_mark import pen_mark
from scalpel_sim.scene.schema import ViewTable
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.looks import Look, look_of_scene
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import Tissue


class Theatre(NamedTuple):
    """An arm of a MuJoCo model, and the tissue beside it, as cameras see them.

    It is for loops of your own; a `Simulation` has all of it.
    """

    model: mujoco.MjModel
    """Compiled model. It is only read."""
    data: mujoco.MjData
    """Its data. It is only read."""
    tissue: Tissue | TissueLink | None = None
    """Tissue in this process, or a link to one; None: there is none."""
    frame: TissueFrame = TissueFrame()
    """Where the tissue lies in the world."""
    blade: Blade | None = None
    """Blade, which segmentation names; None: all of it is arm."""
    graspers: Mapping[str, Grasper] = {}
    """Graspers by the names that segmentation gives them."""
    views: Sequence[ViewTable] = ()
    """Cameras besides those of the model, in the frame of the tissue."""
    look: Look | None = None
    """Look of the tissue; None: that of its material."""
    ink: Callable[[], TriangleMesh] | None = None
    """Returns what is drawn on the skin as it is now, tissue frame; None: nothing is."""

    @property
    def link(self) -> TissueLink | None:
        """The tissue as a link."""
        return InProcessLink(self.tissue) if isinstance(self.tissue, Tissue) else self.tissue

    def labels(self) -> dict[int, str]:
        """Return the names of the labels of the tissue; none of a body with one.

        Where the look has the labels, they have its titles, which pages show, too.
        """
        link = self.link
        if link is None or link.surface().labels is None:
            return {}
        titles = {} if self.look is None else {each.label: each.title for each in self.look.labels}
        found = {label: name or f"label {label}" for label, name in link.describe().labels}
        return {label: titles.get(label, name) for label, name in sorted((found | titles).items())}


def theatre_of(simulation: Simulation) -> Theatre:
    """Return what cameras of a simulation see."""
    scene, arm = simulation.scene, simulation.arm
    look = None if scene is None else look_of_scene(scene)
    is_marked = scene is not None and scene.task is not None and scene.task.marked
    return Theatre(
        arm.model,
        arm.data,
        simulation.link,
        simulation.frame,
        arm.blade,
        {each.name: each.grasper for each in simulation.graspers},
        () if scene is None else scene.views,
        look,
        partial(pen_mark, simulation) if is_marked else None,
    )
