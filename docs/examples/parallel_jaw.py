"""A parallel jaw presses on a block of tissue of 50 g and lifts it off a table by friction."""

import mujoco
import numpy as np

from scalpel_sim import GeomCoupling
from tissue import Material, Tissue, block

# A hand on a slide with two pads that press with a force of their own, and a table.
model = mujoco.MjModel.from_xml_string("""
<mujoco>
  <option timestep="0.001"/>
  <default>
    <default class="pad">
      <geom type="box" size=".003 .012 .012" mass=".03" friction="0.5"/>
    </default>
  </default>
  <worldbody>
    <geom name="table" type="plane" size="1 1 .01" friction="0.5"/>
    <body name="hand" pos="0 0 .06">
      <joint name="lift" type="slide" axis="0 0 1" damping="2"/>
      <geom name="palm" size=".01" mass=".1"/>
      <body name="left" pos="-.022 0 -.04">
        <joint name="left" type="slide" axis="1 0 0" damping="3"/><geom class="pad"/>
      </body>
      <body name="right" pos=".022 0 -.04">
        <joint name="right" type="slide" axis="-1 0 0" damping="3"/><geom class="pad"/>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="lift" kp="3000" kv="60"/><motor joint="left"/><motor joint="right"/>
  </actuator>
</mujoco>
""")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)

edge = 0.0368  # of a cube of 50 g of the density of water [m]
cube = block(cells=(4, 4, 4), size=(edge, edge, edge))
cube = cube._replace(positions=cube.positions - [edge / 2, edge / 2, 0.0])  # under the palm
soft = Material(law="neo_hookean", young_modulus=20e3, poisson_ratio=0.45, viscous_damping=20.0)
tissue = Tissue(cube, soft)
touch = GeomCoupling(data, tissue)  # with the table, the palm and both pads

height = tissue.pieces()[0].centre[2]
while data.time < 2.0:
    data.ctrl[1:] = 1.5 * min(data.time / 0.2, 1.0)  # the pads press with 1.5 N,
    data.ctrl[0] = 0.02 * np.clip((data.time - 0.4) / 0.5, 0.0, 1.0)  # then the hand goes up
    mujoco.mj_step1(model, data)
    touch.follow()
    tissue.step(None, model.opt.timestep)
    touch.apply()
    mujoco.mj_step2(model, data)

held = touch.wrench("left").force + touch.wrench("right").force
way = tissue.pieces()[0].centre[2] - height
print(f"lifted by {1e3 * way:.1f} mm; the pads carry {-held[2]:.3f} N")
