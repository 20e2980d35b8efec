"""Take images of a cut: colours, depth, and what each pixel shows."""

from PIL import Image

from scalpel_sim import SCENES, Camera, prepare

simulation = prepare(SCENES["slab"])
camera = Camera(simulation, "endoscope", width=320, height=240)
overview = camera.another("overview", width=128, height=128)  # costs less than a second Camera

simulation.run(0.6)
rgb, depth, segmentation = camera.image()
Image.fromarray(rgb).save("endoscope.png")
Image.fromarray(overview.rgb()).save("overview.png")

for name in ("skin", "cut", "blade"):
    seen = segmentation == camera.ids[name]
    print(f"{name}: {seen.sum()} pixels, from {1e3 * depth[seen].min():.0f} mm on")
