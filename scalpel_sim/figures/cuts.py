"""The cuts of the paper's figures: an arm leads a scalpel through a grid that is pulled apart."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bridge.frames import TissueFrame
from bridge.link import InProcessLink
from scalpel_sim.body import make_tissue
from scalpel_sim.draping import TriangleMesh
from scalpel_sim.model_shapes import Shape, body_poses, shapes_of
from scalpel_sim.placement import place
from scalpel_sim.scenes import SCENES
from scalpel_sim.simulation import Simulation
from scalpel_sim.stroke import Stroke
from tissue.types import BladeSegment, FloatArray, Snapshot, Surface

SPEED = 0.06
"""Of the blade [m/s]."""
POSE_EVERY = 1e-3
"""Between two poses of a stroke [m]."""
REST = 0.4
"""Time after the stroke in which the tissue swings out [s]."""
TOOL = ("blade", "stylus")
"""Bodies of the arm that are seen in a picture; the rest of it would stand in the way."""


class Cut(NamedTuple):
    """A body, a way through it, and when to look."""

    scene: str
    stretch: float
    """How far the held sides are pulled apart, as a fraction: the paper's displacement boundary
    conditions."""
    way: FloatArray
    """Corners of the way of the blade seen from above, as shares of the body's extent along x and
    y; shape (n, 2). Between them it runs smoothly."""
    depth: float
    """How far the tip reaches below the body's upper side, as a share of its height."""
    lean: float
    """By how much the edge leans towards +x [rad]."""
    moments: tuple[float, ...]
    """When to look, as shares of the stroke; 1 is after the rest."""


FIGURE_10 = Cut(
    scene="slab",
    stretch=0.3,
    way=np.array([[0.43, -0.2], [0.57, 1.5]]),
    depth=0.7,
    lean=0.12,
    moments=(0.0, 0.35, 0.65, 1.0),
)
"""Off the planes of the grid in every direction: a cut along them would split nothing."""

FIGURE_12 = (
    Cut(
        scene="grid2",
        stretch=0.3,
        way=np.array(
            [[0.15, -0.3], [0.3, 0.0], [0.62, 0.45], [0.55, 0.8], [0.3, 1.1], [-0.2, 1.5]]
        ),
        depth=0.75,
        lean=0.0,
        moments=(1.0,),
    ),
    Cut(
        scene="grid7",
        stretch=0.3,
        way=np.array(
            [[0.5, -0.25], [0.35, 0.15], [0.45, 0.45], [0.65, 0.7], [0.55, 1.0], [0.4, 1.6]]
        ),
        depth=0.7,
        lean=0.0,
        moments=(1.0,),
    ),
)
"""An arc and an S: the paper's "arbitrary cutting trajectories on even coarse initial meshes"."""


class Moment(NamedTuple):
    """A body and the scalpel at one instant, tissue frame."""

    snapshot: Snapshot
    surface: Surface
    tool: list[tuple[TriangleMesh, Shape]]
    """The parts of the scalpel, tissue frame, and what they are."""


def moments(cut: Cut) -> list[Moment]:
    """Do a cut, and return what it looks like at its moments."""
    scene = replace(SCENES[cut.scene], stretch=cut.stretch)
    link = InProcessLink(make_tissue(scene), scene.name)
    bounds = link.describe().bounds
    stroke = _stroke(cut, bounds)
    placement = place(stroke, bounds, scene.arm)
    simulation = Simulation(
        placement.arm(), stroke, link, TissueFrame(origin=placement.tissue_origin)
    )
    found = []
    for share in cut.moments:
        at = stroke.duration + REST if share == 1.0 else share * stroke.duration
        simulation.run(at)
        found.append(Moment(link.snapshot(), link.surface(), _tool(simulation)))
    return found


def _stroke(cut: Cut, bounds: FloatArray) -> Stroke:
    """Return the stroke along the way, with the edge a little longer than it cuts deep."""
    low, high = bounds
    corners = low[:2] + cut.way * (high - low)[:2]
    way = _evenly(_smooth(corners))
    ahead = np.gradient(way, axis=0)
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    height = float(high[2] - low[2])
    up = np.array([np.sin(cut.lean), 0.0, np.cos(cut.lean)])
    below, above = cut.depth * height, 0.35 * height
    segments = []
    for (x, y), forward in zip(way, ahead, strict=True):
        at = np.array([x, y, high[2]])
        segments.append(BladeSegment(at - below * up, at + above * up, np.array([*forward, 0.0])))
    times = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(way, axis=0), axis=1))]) / SPEED
    return Stroke(times, segments, cut.scene)


def _smooth(corners: FloatArray) -> FloatArray:
    """Return a curve through the corners (Catmull and Rom's), shape (n, 2)."""
    if len(corners) == 2:
        return corners
    padded = np.concatenate(
        [[2.0 * corners[0] - corners[1]], corners, [2.0 * corners[-1] - corners[-2]]]
    )
    t = np.linspace(0.0, 1.0, 64, endpoint=False)[:, None]
    parts = []
    for p0, p1, p2, p3 in zip(padded, padded[1:], padded[2:], padded[3:], strict=False):
        parts.append(
            0.5
            * (
                2.0 * p1
                + (p2 - p0) * t
                + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t**2
                + (3.0 * p1 - p0 - 3.0 * p2 + p3) * t**3
            )
        )
    return np.concatenate([*parts, corners[-1:]])


def _evenly(curve: FloatArray) -> FloatArray:
    """Return points on a curve that lie `POSE_EVERY` apart, shape (n, 2)."""
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    at = np.linspace(0.0, along[-1], max(2, int(np.ceil(along[-1] / POSE_EVERY)) + 1))
    return np.stack([np.interp(at, along, curve[:, i]) for i in range(2)], axis=1)


def _tool(simulation: Simulation) -> list[tuple[TriangleMesh, Shape]]:
    """Return the scalpel as it is held now, tissue frame."""
    model, poses = simulation.arm.model, body_poses(simulation.arm.data)
    frame = simulation.frame
    found = []
    for shape in shapes_of(model):
        if model.body(shape.body).name not in TOOL or shape.is_target:
            continue
        mesh = _posed(_posed(shape.mesh, shape.pose), poses[shape.body])
        mesh = mesh._replace(
            positions=frame.points_to_tissue(mesh.positions),
            normals=frame.vectors_to_tissue(mesh.normals),
        )
        found.append((mesh, shape))
    return found


def _posed(mesh: TriangleMesh, pose: FloatArray) -> TriangleMesh:
    """Return a mesh moved to a pose: position [m] and quaternion (w, x, y, z), shape (7,)."""
    w, x, y, z = pose[3:]
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    return mesh._replace(
        positions=mesh.positions @ turn.T + pose[:3], normals=mesh.normals @ turn.T
    )
