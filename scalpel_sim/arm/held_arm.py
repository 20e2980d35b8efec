"""Another arm in the MuJoCo model of a run, and the grasper that it holds."""

from typing import NamedTuple

import mujoco

from scalpel_sim.arm.collision_groups import collide_as_one_arm
from scalpel_sim.arm.grasper import GuidedGrasper
from scalpel_sim.arm.model_options import take_options
from tissue import FloatArray


class HeldArm(NamedTuple):
    """An arm with a grasper, which stands in the world of another arm."""

    name: str
    """Name of the grasper; names of the arm in the model begin with it."""
    spec: mujoco.MjSpec
    """Its model, with the hand that leads the grasper, yet to be compiled."""
    qpos: FloatArray
    """Its configuration at the start [rad, m], that of the jaws last."""
    position: FloatArray
    """Where the origin of its model is in the world [m], shape (3,)."""
    quaternion: FloatArray
    """How it is turned there (w, x, y, z)."""
    workspace: FloatArray | None = None
    """Lowest and highest place where a hand may lead the middle of the pads [m], tissue frame,
    shape (2, 3); None: it follows a script."""

    @property
    def prefix(self) -> str:
        """What the names of its parts begin with."""
        return f"{self.name}_"

    def stand_in(self, spec: mujoco.MjSpec) -> None:
        """Have it stand in the world of a model that is yet to be compiled.

        What its own world has to look at, planes and lights, is left out, and so are keyframes:
        in a model of more joints they have too few numbers. It collides with the other arms.

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
        spec.attach(own, prefix=self.prefix, frame=place)

    def grasper(self, model: mujoco.MjModel, data: mujoco.MjData) -> GuidedGrasper:
        """Return its grasper in the compiled model of the run."""
        return GuidedGrasper(model, data, self.prefix)
