"""The table that tissue lies on, in the MuJoCo model of a run: instruments stop at it."""

from typing import NamedTuple

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.arm.collision_groups import STANDING
from scalpel_sim.arm.free_names import free_prefix
from scalpel_sim.arm.standing_fixture import STEEL
from tissue import FloatArray, Geom

TABLETOP = "tabletop"
"""Name of its geom, where the model has none of that name."""

_COLOUR = (0.32, 0.38, 0.4, 1.0)


class Tabletop(NamedTuple):
    """A board, as tissue touches it and as it stands in the world."""

    geom: Geom
    """Its shape: a box."""
    centre: FloatArray
    """Where its middle is [m], tissue frame, shape (3,)."""
    frame: TissueFrame = TissueFrame()
    """Where the tissue lies in the world."""

    @property
    def bounds(self) -> FloatArray:
        """Its lowest and highest corner, tissue frame [m], shape (2, 3)."""
        half = np.array(self.geom.size)
        return np.stack([self.centre - half, self.centre + half])

    def stand_in(self, spec: mujoco.MjSpec) -> str:
        """Stand it in the world of a model that is yet to be compiled.

        It collides with arms and what they hold.

        Returns:
            The name of its geom there.
        """
        name = free_prefix(spec, {"geoms": [TABLETOP]}) + TABLETOP
        quaternion, frame = np.empty(4), self.frame
        mujoco.mju_mat2Quat(quaternion, frame.rotation.ravel())
        spec.worldbody.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_BOX,
            size=self.geom.size,
            pos=frame.points_to_world(self.centre),
            quat=quaternion,
            friction=[self.geom.friction, 0.005, 0.0001],
            solref=STEEL,
            contype=1 | STANDING,
            conaffinity=1,
            rgba=_COLOUR,
        )
        return name
