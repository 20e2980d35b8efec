"""Cut a body along a given wavy surface, without a blade, and write it for other programs."""

import numpy as np

from tissue import Tissue, block, write_vtu

tissue = Tissue(block((4, 6, 4), (0.04, 0.06, 0.04)))
y = np.linspace(-0.01, 0.07, 40)
x = 0.018 + 0.004 * np.sin(80.0 * y)
tip, heel = np.stack([x, y, 0.0 * y - 0.01], axis=1), np.stack([x, y, 0.0 * y + 0.05], axis=1)
area = tissue.incise(np.stack([tip, heel], axis=1), forward=(0.0, 1.0, 0.0))
write_vtu("incised.vtu", tissue.snapshot())  # tetrahedra, for ParaView
tissue.surface().to_trimesh().export("incised.stl")  # triangles
print(f"{area * 1e6:.0f} mm2, {tissue.n_pieces()} pieces")
