"""Cut a block that is held on one side only; the loose half falls on a floor."""

import numpy as np

from tissue import Material, Tissue, block, fixed_nodes

mesh = block(cells=(4, 2, 2), size=(0.04, 0.02, 0.02))
soft = Material(young_modulus=10e3, poisson_ratio=0.45, law="neo_hookean")
tissue = Tissue(mesh, soft, fixed=fixed_nodes(mesh, "left"), floor=-0.03)
tissue.settle()

z = np.array([-0.02, 0.04])
places = [[[0.018, y, height] for height in z] for y in (-0.02, 0.05)]
tissue.incise(places, forward=(0.0, 1.0, 0.0))

for _ in range(2000):  # two seconds
    result = tissue.step(None, 1e-3)

held, loose = sorted(tissue.pieces(), key=lambda piece: not piece.is_held)
weight, floor = 9.81 * loose.mass, result.body_contacts.force_of_floor[2]
print(f"{loose.mass * 1e3:.1f} g lie {(loose.centre[2] + 0.03) * 1e3:.1f} mm above the floor")
print(f"the floor bears {floor / weight:.2f} of their weight")
