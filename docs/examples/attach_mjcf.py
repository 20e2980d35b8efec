"""Cut a block with an arm of your own, and read the force on its blade."""

import mujoco
import numpy as np

from bridge import Bridge, TissueFrame
from scalpel_sim import Blade
from tissue import Material, Tissue, block, fixed_nodes

# Your arm. Here it is a blade on a slide, driven along y at 50 mm/s.
model = mujoco.MjModel.from_xml_string("""
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="scalpel" pos="0 -0.05 0.12">
      <joint name="slide" type="slide" axis="0 1 0"/>
      <geom type="box" size="0.0005 0.003 0.03" mass="0.03"/>
      <site name="heel" pos="0 0.003 0.03"/>
      <site name="tip" pos="0 0.003 -0.03"/>
    </body>
  </worldbody>
  <actuator><velocity joint="slide" kv="50"/></actuator>
</mujoco>
""")
data = mujoco.MjData(model)
data.ctrl[0] = 0.05

# The tissue: 40 x 40 x 20 mm in its own frame, held at its left and right sides (low and high x).
mesh = block(cells=(4, 4, 2), size=(0.04, 0.04, 0.02))
soft = Material(young_modulus=10e3, toughness=20.0)
tissue = Tissue(mesh, soft, fixed=fixed_nodes(mesh, "left,right"))
tissue.settle()

# Where the tissue lies in the world, and which edge of which body cuts.
bridge = Bridge(tissue, TissueFrame(origin=np.array([-0.0202, -0.02, 0.11])))
blade = Blade(model, data, heel="heel", tip="tip", forward=(0.0, 1.0, 0.0))

forces = []
while data.time < 2.0:
    mujoco.mj_step1(model, data)  # the sites are now where qpos says
    wrench = bridge.step(blade.segment(), model.opt.timestep)  # advances the tissue by 1 ms
    blade.apply(wrench)  # acts in this very step
    mujoco.mj_step2(model, data)
    forces.append(np.linalg.norm(wrench.force))

area = bridge.result.cut_area * 1e6
print(f"peak {max(forces):.2f} N, cut {area:.0f} mm2, {tissue.n_pieces()} pieces")
