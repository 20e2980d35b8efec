"""Two jaws hold a bar of tissue and stretch it; a blade cuts it between them."""

import mujoco
import numpy as np

from bridge import Bridge
from scalpel_sim import Blade, Grip
from tissue import Material, Tissue, block

# Each jaw and the blade on a slide of its own. Gravity is left out.
model = mujoco.MjModel.from_xml_string("""
<mujoco>
  <option timestep="0.001" integrator="implicitfast" gravity="0 0 0"/>
  <default><geom type="box" size=".01 .01 .01" mass=".2"/></default>
  <worldbody>
    <body name="left"><joint name="left" type="slide" axis="1 0 0"/><geom/></body>
    <body name="right" pos=".08 0 0"><joint name="right" type="slide" axis="1 0 0"/><geom/></body>
    <body name="scalpel" pos=".04 -.02 0">
      <joint name="scalpel" type="slide" axis="0 1 0"/>
      <geom size=".0005 .003 .03" mass=".03"/>
      <site name="heel" pos="0 .003 .045"/>
      <site name="tip" pos="0 .003 -.015"/>
    </body>
  </worldbody>
  <actuator>
    <position joint="left" kp="2000" kv="40"/>
    <position joint="right" kp="2000" kv="40"/>
    <position joint="scalpel" kp="2000" kv="15"/>
  </actuator>
</mujoco>
""")
data = mujoco.MjData(model)
mujoco.mj_forward(model, data)

bar = block(cells=(8, 3, 3), size=(0.08, 0.02, 0.02))
soft = Material(law="neo_hookean", young_modulus=20e3, toughness=10.0, viscous_damping=40.0)
tissue = Tissue(bar, soft, gravity=(0.0, 0.0, 0.0))
bridge = Bridge(tissue)
blade = Blade(model, data, forward=(0.0, 1.0, 0.0))
hands = [Grip(data, side, bridge, side, stiffness=4e3, damping=10.0) for side in ("left", "right")]

pulls = []
while data.time < 2.0:
    stretch = min(data.time / 0.3, 1.0)
    data.ctrl[:2] = -2e-3 * stretch, 2e-3 * stretch  # each hand pulls by 2 mm,
    data.ctrl[2] = 0.05 * np.clip((data.time - 0.5) / 0.8, 0.0, 1.0)  # then the blade goes through
    mujoco.mj_step1(model, data)
    for hand in hands:
        hand.follow()
    blade.apply(bridge.step(blade.segment(), model.opt.timestep))
    for hand in hands:
        hand.apply()
    mujoco.mj_step2(model, data)
    pulls.append(hands[1].wrench.force[0])

print(f"the right hand felt {-min(pulls):.2f} N, and {abs(pulls[-1]):.2f} N after the cut")
print(f"{tissue.n_pieces()} pieces; the hands hold {[hand.n_points for hand in hands]} points")
