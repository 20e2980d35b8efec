"""Random strokes through thin bodies leave two pieces and no fragment.

The bodies are half shells of 60 mm with walls of 3 to 8 mm and elements of half to the whole wall,
flat sheets of 6 mm, and bars whose every node lies on the skin. Each is of gel, held at its left
and right, and sags under gravity. A scalpel without an arm makes a straight, slanted or curved
stroke through it, at a random place, angle and speed.
"""

import itertools

import numpy as np

from scalpel_sim.scene.blade import SCALPEL
from scalpel_sim.scene.scene import GEL
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.strokes.scene_stroke import stroke_through
from tests.support.battery import battery
from tests.support.bodies import half_shell
from tissue import BladeSegment, BladeSweep, TetrahedralMesh, Tissue, block, fixed_nodes

DIAMETER, DT, REST = 0.06, 1e-3, 50
"""Size of shells and sheets [m], a frame [s], and the frames after the blade has left."""
LEAST_SHARE = 0.05
"""Share of the volume that each of two halves has at least; strokes stay away from the sides."""
SEED_SIZE = 24
"""Cases that are drawn from one seed."""


def thin_body(random, number):
    """Return a mesh: three of five are shells, one is a sheet, one a bar."""
    wall, share = random.uniform(3e-3, 8e-3), random.uniform(0.5, 1.0)
    cells, width = int(random.integers(8, 21)), random.uniform(6e-3, 15e-3)
    if number % 5 == 1:
        return block((cells, cells, 1 + cells // 14), (DIAMETER, DIAMETER, 6e-3))
    if number % 5 == 3:
        return block((cells, 1, 1), (DIAMETER, width, width))
    return half_shell(wall, share * wall, DIAMETER)


def edges_of_stroke(random, body, kind):
    """Return the poses of a stroke that is turned and shifted, one for each frame."""
    low, high = body.positions.min(axis=0), body.positions.max(axis=0)
    place, yaw = random.uniform(-0.1, 0.1), random.uniform(-0.2, 0.2)
    stroke = stroke_through(body, [StrokeTable(kind=kind, speed=random.uniform(0.03, 0.12))], GEL)
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0], [np.sin(yaw), np.cos(yaw), 0], [0, 0, 1]])
    centre = 0.5 * (low + high)
    to = centre + np.array([place * (high - low)[0], 0.0, 0.0])
    return [
        BladeSegment(
            turn @ (pose.tip - centre) + to, turn @ (pose.heel - centre) + to, turn @ pose.forward
        )
        for pose in map(stroke.pose, np.arange(0.0, stroke.duration + DT, DT))
    ]


@battery(n_per_change=1, n_long=12 * SEED_SIZE)
def test_a_random_stroke_leaves_two_pieces_of_a_thin_body_and_no_fragment(case):
    seed, number = divmod(case, SEED_SIZE)
    random = np.random.default_rng((seed, number))
    mesh = thin_body(random, number)
    tissue = Tissue(mesh, GEL, fixed=fixed_nodes(mesh, "left,right"), blade=SCALPEL)
    tissue.settle()
    body = TetrahedralMesh(tissue.snapshot().positions, mesh.tetrahedra)
    kind = ("straight", "slanted", "curved")[number // 5 % 3]
    edges = edges_of_stroke(random, body, kind)
    for sweep in (*itertools.starmap(BladeSweep, itertools.pairwise(edges)), *[None] * REST):
        tissue.step(sweep, DT)
    volumes = np.array([piece.rest_volume for piece in tissue.pieces()])
    assert len(volumes) == 2 and volumes.min() >= LEAST_SHARE * volumes.sum()
