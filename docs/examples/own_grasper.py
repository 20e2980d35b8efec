"""A robot of your own is the left hand: it holds a grasper, and lifts the edge of a lobe."""

from pathlib import Path

import mujoco
from msgspec.structs import replace

from scalpel_sim import SCENES, changed, prepare

robot = mujoco.MjSpec.from_file(str(Path(__file__).parent / "robot.xml"))
robot.delete(robot.body("scalpel"))  # its flange is free
Path("bare.xml").write_text(robot.to_xml())

scene = SCENES["retract"]
slanted = {"approach": (-0.8, 0.0, -0.6), "across": (-0.6, 0.0, 0.8)}  # its flange is 6 cm wide
motion = [replace(row, **slanted) for row in scene.graspers[0].motion]
place = {"model": "bare.xml", "at": "wrist_3", "pos": (0.6, 0.03, -0.1)}
simulation = prepare(changed(scene, graspers=(replace(scene.graspers[0], motion=motion, **place),)))
simulation.run(simulation.duration + 0.5)
left = simulation.graspers[0]
print(f"{simulation.link.n_pieces()} pieces; the robot holds {left.n_points} points of one,")
force = simulation.recording.vector("left_force")[-500:].mean(axis=0)  # it swings
mass = simulation.link.tissue.pieces()[1].mass
print(f"which pulls with {-force[2]:.3f} N and has {1e3 * mass:.2f} g")
