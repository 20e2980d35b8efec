"""Lead the arm's blade along a path of your own: a file with a row for each pose."""

from pathlib import Path

import numpy as np

from scalpel_sim import SCENES, StrokeTable, changed, prepare

rows = ["t,tip_x,tip_y,tip_z,heel_x,heel_y,heel_z"]
for t in np.linspace(0.0, 0.8, 81):  # 0.8 s through the slab along y, at 0.1 m/s, on a wavy line
    y = -0.01 + 0.1 * t
    x = 0.0215 + 0.001 * np.sin(60.0 * y)
    rows.append(f"{t},{x},{y},-0.005,{x},{y},0.055")
Path("wavy.csv").write_text("\n".join(rows))

wavy = StrokeTable(kind="recorded", file="wavy.csv")
simulation = prepare(changed(SCENES["slab"], strokes=(wavy,)))
simulation.run(seconds=0.8)
result = simulation.result
print(f"cut {result.cut_area * 1e6:.0f} mm2, {simulation.link.n_pieces()} pieces")
