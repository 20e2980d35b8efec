"""A MuJoCo model with a geom of each shape, and a blade above the middle of a block."""

import mujoco
import numpy as np

from bridge import TissueFrame
from scalpel_sim.viewer.scene3d import Readings

MJCF = """
<mujoco>
  <asset>
    <mesh name="pyramid" vertex="0 0 0  .02 0 0  0 .02 0  0 0 .02"/>
    <hfield name="hill" nrow="3" ncol="3" size=".05 .05 .02 .01" elevation="0 0 0 0 1 0 0 0 0"/>
  </asset>
  <worldbody>
    <geom name="table" type="plane" size="0 0 .01" rgba=".3 .4 .4 1"/>
    <geom name="hill" type="hfield" hfield="hill" pos=".3 .3 0"/>
    <body name="stand" pos="0 -.15 0">
      <geom name="drum" type="cylinder" size=".03 .02" pos="0 0 .02"/>
      <geom name="ball" type="sphere" size=".02" pos="0 0 .06"/>
      <geom name="egg" type="ellipsoid" size=".01 .02 .03" pos=".05 0 .05"/>
      <geom name="stone" type="mesh" mesh="pyramid" pos="-.06 0 .01"/>
      <geom name="hidden" type="sphere" size=".1" group="3"/>
      <geom name="glass" type="sphere" size=".1" rgba="1 1 1 0"/>
      <body name="handle" pos="0 .15 .12">
        <joint type="slide" axis="0 1 0"/>
        <geom name="grip" type="capsule" size=".006" fromto="0 0 0 0 0 .06" rgba=".1 .2 .6 1"/>
        <body name="blade">
          <geom name="blade" type="box" size=".0002 .003 .02" pos="0 .0 -.02"/>
          <site name="heel" pos="0 .003 0"/>
          <site name="tip" pos="0 .003 -.04"/>
        </body>
      </body>
    </body>
    <body name="hand" mocap="true"><geom name="target" type="sphere" size=".004"/></body>
  </worldbody>
</mujoco>
"""

FRAME = TissueFrame(origin=np.array([-0.02, -0.03, 0.05]))
"""Frame of the block of `cut_block`, whose middle lies at x = y = 0 of the world."""


def little_arm() -> tuple[mujoco.MjModel, mujoco.MjData]:
    """Return the model, and its state at the start."""
    model = mujoco.MjModel.from_xml_string(MJCF)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    return model, data


def readings(time: float) -> Readings:
    """Return readings at a time [s]; the force is 1 N backwards."""
    return Readings(time, np.array([0.0, -1.0, 0.0]), np.array([0.0, 0.0, 0.08]), 1e-4, 576)
