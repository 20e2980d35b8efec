"""From a scene to a simulation: the tissue, a stroke through it, and an arm that reaches."""

import logging
from collections.abc import Iterable, Sequence

import numpy as np

from bridge import Fixture, InProcessLink, TissueLink
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.collision_monitor import floor_below
from scalpel_sim.arm.free_names import free_name
from scalpel_sim.arm.standing import StandingFixture, Tabletop
from scalpel_sim.instruments.driven_grasper import DrivenGrasper
from scalpel_sim.instruments.floating_arms import floating_arms_in
from scalpel_sim.instruments.geom_coupling import GeomCoupling
from scalpel_sim.instruments.scene_arms import (
    ArmSurroundings,
    own_arm_in,
    project_arm_in,
    resting_stroke,
)
from scalpel_sim.instruments.scene_graspers import grip_settings, motions_of
from scalpel_sim.preparation.tissue import highest_toughness, make_tissue, tabletop_of
from scalpel_sim.scene.arm_tables import GrasperTable
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scoring.score import Score
from scalpel_sim.scoring.yardstick import yardstick_of
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.expected_force import ExpectedForce, expected_force
from scalpel_sim.strokes.grasp_motion import GraspMotion
from scalpel_sim.strokes.planning import check_meets
from scalpel_sim.strokes.scene_stroke import cuts_somewhere, meets_somewhere, stroke_through
from scalpel_sim.strokes.stroke import Stroke
from tissue import TetrahedralMesh

_log = logging.getLogger("scalpel_sim")

_ON_TABLE = 1e-9
"""Depth below a table of an edge that ends on it, at most [m]: that is rounding, and no warning."""


def prepare(
    scene: Scene,
    link: TissueLink | None = None,
    fixtures: Iterable[Fixture] = (),
    *,
    is_led: bool = False,
    records: bool = True,
    frame_seconds: float | None = None,
) -> Simulation:
    """Return the simulation of a scene, at its start.

    The stroke is planned on the body as it lies there, sagged and stretched. Only what the link
    describes is used, so that a body in another process gives the same run as one in this process.

    Args:
        scene: What to cut, and how.
        link: A body that is already there; None makes that of the scene in this process.
        fixtures: Rigid bodies around it, in the tissue frame: where that lies in the world is
            chosen here, so that the arm reaches.
        is_led: Whether a hand will lead the blade and the graspers: then they rest where their
            scripts start, and the arms stand where they reach around the body, as far as they do.
        records: Whether frames are recorded: see `Simulation.records`.
        frame_seconds: Length of a frame of instruments that no arm carries, which are where their
            hands are [s]: see `FloatingArm`. None: the arms of the scene carry them, at 1 kHz.

    Raises:
        ValueError: parts of the scene do not fit together; the message says which.
        LinkError: the body is elsewhere, and cannot be reached.
    """
    fixtures = list(fixtures)
    if link is None:
        link = InProcessLink(make_tissue(scene), scene.name)
    body, tissue = link.snapshot(), link.describe()
    mesh, bounds = TetrahedralMesh(body.positions, body.tetrahedra), tissue.bounds
    table = tabletop_of(scene, bounds)
    stroke = stroke_through(
        mesh, scene.strokes, tissue.material, scene.world.stop, body.rest_positions
    )
    if not stroke.is_led and meets_somewhere(scene.strokes):
        check_meets(stroke, mesh)
    motions = motions_of(scene.graspers)
    planned = stroke
    if is_led:
        stroke, motions = resting_stroke(stroke.pose(0.0)), [each.at_rest() for each in motions]
    needed = _needed(stroke, mesh, scene)
    if not stroke.is_led:
        _warn_of_table(stroke, table)
    boxes = bounds[None] if table is None else np.stack([bounds, table.bounds])
    floor = []
    if tissue.floor is not None:
        name = free_name("floor", [fixture.name for fixture in fixtures])
        floor.append(floor_below(bounds, tissue.floor, name))
    around = ArmSurroundings(boxes, table, [*fixtures, *floor])
    if frame_seconds is not None:
        stands = floating_arms_in(scene, stroke, motions, around, frame_seconds)
    elif scene.arm.model is None:
        stands = project_arm_in(scene, stroke, motions, around, needed)
    else:
        stands = own_arm_in(scene, stroke, motions, around)
    if np.ndim(scene.world.gravity) > 0:
        fall = stands.frame.vectors_to_world(np.array(scene.world.free_fall))
        stands.arm.model.opt.gravity[:] = fall
    _warn_of_weakness(needed, stands.arm)
    floats = frame_seconds is not None
    standing = [each for each in stands.others if isinstance(each, StandingFixture)]
    simulation = Simulation(
        stands.arm,
        stands.stroke,
        link,
        stands.frame,
        [each.fixture for each in standing],
        tissue_every=1 if floats else scene.arm.tissue_every,
        coupling=None if floats else scene.virtual_coupling(),
        passivity=scene.arm.passivity and not floats,
    )
    simulation.scene = scene
    simulation.records = records
    simulation.workspace = stands.room
    simulation.expected_force = needed.force
    if scene.graspers:
        _add_graspers(simulation, scene.graspers, motions)
    if scene.task is not None:
        yardstick = yardstick_of(scene.task, planned, body, link.label_names)
        simulation.score = Score(yardstick, simulation, body)
    if isinstance(link, InProcessLink):
        simulation.note_start()
    return simulation


def _add_graspers(
    simulation: Simulation,
    graspers: Sequence[GrasperTable],
    motions: Sequence[GraspMotion],
) -> None:
    """Add graspers, and couple all bodies of the arms but the blade to the tissue.

    Args:
        simulation: Before its first frame.
        graspers: What the scene says of them.
        motions: Where they go.
    """
    arm, bridge = simulation.arm, simulation.bridge
    known: list[str | int] = [arm.blade.body_id]
    known += arm.fixtures.values()  # the tissue has them already
    simulation.coupled_bodies.append(GeomCoupling(arm.data, bridge, without=known))
    for table, motion, grasper, held in zip(
        graspers, motions, arm.graspers, arm.others, strict=True
    ):
        settings, room = grip_settings(table), held.workspace
        simulation.add(
            DrivenGrasper(grasper, arm.data, motion, bridge, settings=settings, workspace=room)
        )


def _needed(stroke: Stroke, mesh: TetrahedralMesh, scene: Scene) -> ExpectedForce:
    """Return what the cut will take; nothing for strokes that are not to cut."""
    if not (stroke.is_led or cuts_somewhere(scene.strokes)):
        return ExpectedForce(0.0, 0.0)
    if stroke.is_led:  # its whole edge may be in the tissue
        return ExpectedForce(highest_toughness(scene) * stroke.blade_length, stroke.blade_length)
    return expected_force(stroke, mesh, highest_toughness(scene))


def _warn_of_table(stroke: Stroke, table: Tabletop | None) -> None:
    """Warn before the start that a stroke leads the edge into the table, which stops it."""
    if table is None:
        return
    poses = [stroke.pose(t) for t in stroke.times.tolist()]
    ends = np.array([end for pose in poses for end in (pose.tip, pose.heel)])
    low, high = table.bounds
    over = ((ends >= low) & (ends <= high))[:, :2].all(axis=1)
    depth = float((high[2] - ends[over, 2]).max(initial=0.0))
    if depth > _ON_TABLE:
        _log.warning(
            "the stroke goes %.2g mm below the table, which stops the blade: what is to be cut "
            "there stays whole. Lower [world] table, or end the stroke above it",
            1e3 * depth,
        )


def _warn_of_weakness(needed: ExpectedForce, arm: DrivenArm) -> None:
    """Warn before the start that an arm cannot do the cut."""
    most = arm.limits.force
    if needed.force > most:
        _log.warning(
            "the cut will take some %.2g N (%.3g J/m2 over %.2g mm of edge), and the arm '%s' "
            "renders %.2g N at most: forces above are cut off, and the hand may not lead the blade "
            "through. A smaller --toughness or a shallower stroke takes less",
            needed.force,
            needed.force / needed.width,
            1e3 * needed.width,
            arm.name,
            most,
        )
