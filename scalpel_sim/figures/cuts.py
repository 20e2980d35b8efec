"""The cuts of the paper's figures, and the state of body and scalpel at some moments of them."""

from typing import NamedTuple

import numpy as np

from scalpel_sim.planned_cut import PlannedCut, prepare_cut
from scalpel_sim.scene.read import SCENES
from scalpel_sim.scene.scene import changed
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.model_shapes import Shape, body_poses, shapes_of
from scalpel_sim.viewer.primitives import TriangleMesh
from tissue import FloatArray, Snapshot, Surface

STRETCH = 0.3
"""Strain by which the held sides are pulled apart: the paper's displacement boundary conditions,
and enough for the cut to open."""
REST = 0.4
"""Time after the stroke in which the tissue comes to rest [s]."""
TOOL = ("blade", "stylus", "shaft", "jaw_low", "jaw_high")
"""Ends of the names of bodies of arms that are drawn; the others would hide the cut."""

FIGURE_10 = PlannedCut(
    changed(SCENES["slab"], stretch=STRETCH),
    path=np.array([[0.4, -0.2], [0.62, 1.5]]),
    depth=0.7,
    lean=0.12,
)
"""The cut of Figures 10 and 11. It is oblique to all planes of the grid: a cut along one of them
would split no tetrahedron."""
FIGURE_10_MOMENTS = (0.0, 0.35, 0.65, 1.0)
"""Moments of Figure 10 as fractions of the stroke; the last is after `REST`."""

FIGURE_12 = (
    PlannedCut(
        changed(SCENES["grid2"], stretch=STRETCH),
        path=np.array(
            [[0.15, -0.3], [0.3, 0.0], [0.62, 0.45], [0.55, 0.8], [0.3, 1.1], [-0.2, 1.5]]
        ),
        depth=0.75,
    ),
    PlannedCut(
        changed(SCENES["grid7"], stretch=STRETCH),
        path=np.array(
            [[0.5, -0.25], [0.35, 0.15], [0.45, 0.45], [0.65, 0.7], [0.55, 1.0], [0.4, 1.6]]
        ),
        depth=0.7,
    ),
)
"""The cuts of Figure 12, an arc and an S: the paper's "arbitrary cutting trajectories on even
coarse initial meshes"."""


class Moment(NamedTuple):
    """The body and the scalpel at one moment of a cut, tissue frame."""

    snapshot: Snapshot
    """State of the body."""
    surface: Surface
    """Surface of the body."""
    tool: list[tuple[TriangleMesh, Shape]]
    """Meshes of the scalpel's parts, tissue frame, and the shapes of the model that they show."""


def with_scheme(scheme: str, cut: PlannedCut) -> PlannedCut:
    """Return the cut with another cutting scheme: `stellar` or `paper`."""
    return cut._replace(scene=changed(cut.scene, scheme=scheme))


def moments(cut: PlannedCut, shares: tuple[float, ...] = (1.0,)) -> list[Moment]:
    """Do a cut, and return its moments at fractions of the stroke; 1 is after `REST`."""
    simulation = prepare_cut(cut)
    duration = simulation.stroke.duration
    found = []
    for share in shares:
        simulation.run(duration + REST if share == 1.0 else share * duration)
        found.append(moment_of(simulation))
    return found


def moment_of(simulation: Simulation) -> Moment:
    """Return the body and the instruments as they are now."""
    link = simulation.link
    return Moment(link.snapshot(), link.surface(), _tool_of(simulation))


def _tool_of(simulation: Simulation) -> list[tuple[TriangleMesh, Shape]]:
    """Return the meshes of the instruments as they are now, tissue frame, and their shapes."""
    model, poses = simulation.arm.model, body_poses(simulation.arm.data)
    frame = simulation.frame
    found = []
    for shape in shapes_of(model):
        if shape.is_target or not model.body(shape.body).name.endswith(TOOL):
            continue
        mesh = _posed(_posed(shape.mesh, shape.pose), poses[shape.body])
        mesh = mesh._replace(
            positions=frame.points_to_tissue(mesh.positions),
            normals=frame.vectors_to_tissue(mesh.normals),
        )
        found.append((mesh, shape))
    return found


def _posed(mesh: TriangleMesh, pose: FloatArray) -> TriangleMesh:
    """Return a mesh at a pose: position [m] and quaternion (w, x, y, z), shape (7,)."""
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
