"""Lead an upright edge through a block, without an arm, and print the force on it."""

import numpy as np

from tissue import BladeSegment, BladeSweep, Material, Tissue, block, fixed_nodes

mesh = block(cells=(4, 4, 2), size=(0.04, 0.04, 0.02))
material = Material(young_modulus=10e3, toughness=20.0)
tissue = Tissue(mesh, material, fixed=fixed_nodes(mesh, "left,right"))
tissue.settle()


def edge(y: float) -> BladeSegment:
    """Return an edge at x = 18.5 mm that is longer than the block is high and cuts towards +y."""
    tip, heel = np.array([0.0185, y, -0.01]), np.array([0.0185, y, 0.03])
    return BladeSegment(tip, heel, forward=np.array([0.0, 1.0, 0.0]))


dt, speed = 1e-3, 0.06
forces = []
for y in np.arange(-0.005, 0.05, speed * dt):
    result = tissue.step(BladeSweep(edge(y), edge(y + speed * dt)), dt)
    forces.append(-result.wrench.force[1])

area = result.cut_area * 1e6
print(f"peak {max(forces):.2f} N, cut {area:.0f} mm2, {tissue.n_pieces()} pieces")
