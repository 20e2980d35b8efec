"""Another arm in the MuJoCo model of a run, and the grasper that it holds."""

from typing import NamedTuple

import mujoco

from scalpel_sim.arm.collision_groups import collide_as_one_arm
from scalpel_sim.arm.free_names import free_prefix, names_in
from scalpel_sim.arm.grasper import GRASPER, GuidedGrasper
from scalpel_sim.arm.model_options import take_options
from tissue import FloatArray


class HeldArm(NamedTuple):
    """An arm with a grasper, which stands in the world of another arm."""

    name: str
    """Name of the grasper."""
    spec: mujoco.MjSpec
    """Its model, with the hand that leads the grasper, yet to be compiled."""
    qpos: FloatArray
    """Its configuration at the start [rad, m], that of the jaws last."""
    position: FloatArray
    """Where the origin of its model is in the world [m], shape (3,)."""
    quaternion: FloatArray
    """How it is turned there (w, x, y, z)."""
    of_hand: str
    """Prefix of the names of its hand in its model."""
    of_grasper: str = GRASPER
    """Prefix of the names of its grasper in its model."""
    workspace: FloatArray | None = None
    """Lowest and highest place where a hand may lead the middle of the pads [m], tissue frame,
    shape (2, 3); None: it follows a script."""

    def stand_in(self, spec: mujoco.MjSpec) -> str:
        """Stand it in the world of a model that is yet to be compiled.

        What its own world has to look at, planes and lights, is left out, and so are keyframes:
        in a model of more joints they have too few numbers. It collides with the other arms.

        Returns:
            What the names of its parts begin with there: its own name, where that is free.

        Raises:
            ValueError: there are too many arms.
        """
        for key in list(spec.keys):
            spec.delete(key)
        own = self.spec.copy()
        take_options(own, spec)
        for geom in list(own.worldbody.geoms):
            if geom.type == mujoco.mjtGeom.mjGEOM_PLANE:
                own.delete(geom)
        for part in (*own.worldbody.lights, *own.keys):
            own.delete(part)
        own.nkey = spec.nkey
        collide_as_one_arm(own, spec)
        place = spec.worldbody.add_frame(pos=self.position, quat=self.quaternion)
        prefix = free_prefix(spec, names_in(own), f"{self.name}_")
        spec.attach(own, prefix=prefix, frame=place)
        return prefix

    def grasper(self, model: mujoco.MjModel, data: mujoco.MjData, prefix: str) -> GuidedGrasper:
        """Return its grasper in the compiled model of the run.

        Args:
            model: That model.
            data: Its data.
            prefix: What `stand_in` returned.
        """
        return GuidedGrasper(model, data, prefix + self.of_grasper, prefix + self.of_hand)
