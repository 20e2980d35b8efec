"""Put a clamp in front of the body, which stops the blade, and count the frames of that."""

import numpy as np

from bridge import FixtureBox
from scalpel_sim import SCENES, prepare

# In the frame of the body. The blade comes from the front, along y.
clamp = FixtureBox("clamp", size=np.full(3, 0.01), centre=np.array([0.02, -0.005, 0.02]))
simulation = prepare(SCENES["slab"], fixtures=[clamp])
simulation.run(seconds=0.2)
print(simulation.touching.frames)
