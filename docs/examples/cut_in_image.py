"""Cut along a line that is drawn in an image, as a detector or a person with a mouse would."""

import numpy as np
from PIL import Image, ImageDraw

from scalpel_sim import SCENES, Camera, StrokeTable, changed, pixels_to_points, prepare

LINE = [(128, 112), (155, 128), (186, 116)]  # columns and rows of the image

scene = SCENES["organ"]
camera = Camera(prepare(scene), "endoscope", width=320, height=240)
image = Image.fromarray(camera.rgb())
ImageDraw.Draw(image).line(LINE, fill="white", width=2)
image.save("planned.png")

points = pixels_to_points(camera, LINE, depth=camera.depth())  # in the body at rest [m]
stroke = StrokeTable(kind="traced", points=[tuple(p) for p in points], depth=6e-3, speed=0.05)
simulation = prepare(changed(scene, strokes=(stroke,)))
after = Camera(simulation, "endoscope", width=320, height=240)
simulation.run(simulation.duration)
Image.fromarray(after.rgb()).save("cut.png")
length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
print(f"{1e6 * simulation.result.cut_area:.0f} mm2 along {1e3 * length:.0f} mm")
