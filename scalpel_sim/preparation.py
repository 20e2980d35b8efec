"""From a scene to a simulation: the tissue, a stroke through it, and an arm that reaches."""

import logging
import math
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

import mujoco
import numpy as np

from bridge import DeviceLimits, Fixture, InProcessLink, TissueFrame, TissueLink
from scalpel_sim.arm.collision_monitor import floor_below
from scalpel_sim.arm.geom_coupling import GeomCoupling
from scalpel_sim.arm.grasper import HALF_PAD
from scalpel_sim.arm.held_arm import HeldArm
from scalpel_sim.arm.led_arm import LedArm
from scalpel_sim.arm.own_arm import move_to_start, move_within, own_arm
from scalpel_sim.arm.placement import (
    Placement,
    PlacementError,
    place,
    place_if_reached,
    stays_in_reach,
)
from scalpel_sim.arm.reachable_box import arm_for, grown_within, placed_within, shrunk, tour_of
from scalpel_sim.arm.scene_graspers import arms_with_graspers, led_graspers, motions_of
from scalpel_sim.arm.standing import Standing
from scalpel_sim.arm.standing_fixture import StandingFixture
from scalpel_sim.arm.tabletop import Tabletop
from scalpel_sim.errors import UsageError
from scalpel_sim.hands.workspace import ROOM_OF_GRASPER, resting_stroke, workspace_in
from scalpel_sim.scene_body import highest_toughness, make_tissue, tabletop_of
from scalpel_sim.scene_parts.own_arm_settings import OwnArm
from scalpel_sim.scene_parts.scene import Scene
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.expected_force import ExpectedForce, expected_force
from scalpel_sim.strokes.grasp_motion import GraspMotion
from scalpel_sim.strokes.planning import check_meets
from scalpel_sim.strokes.scene_stroke import stroke_through
from scalpel_sim.strokes.sequence import lengthened
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.tables.grasper import GrasperTable
from tissue import FloatArray, TetrahedralMesh

_log = logging.getLogger("scalpel_sim")

_SAME_LENGTH = 1e-9
"""Share by which two lengths of one blade may differ, by rounding."""

_ON_TABLE = 1e-9
"""How far below a table an edge may be that ends on it [m]: that is rounding, and no warning."""


def prepare(
    scene: Scene,
    link: TissueLink | None = None,
    fixtures: Iterable[Fixture] = (),
    *,
    is_led: bool = False,
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

    Raises:
        ValueError: parts of the scene do not fit together; the message says which.
        LinkError: the body is elsewhere, and cannot be reached.
    """
    if link is None:
        link = InProcessLink(make_tissue(scene), scene.name)
    body, tissue = link.snapshot(), link.describe()
    mesh, bounds = TetrahedralMesh(body.positions, body.tetrahedra), tissue.bounds
    table = tabletop_of(scene, bounds)
    stops = [height for height in (scene.table, scene.floor) if height is not None]
    stroke = stroke_through(mesh, scene.strokes, tissue.material, max(stops, default=-math.inf))
    if not stroke.is_led:
        check_meets(stroke, mesh)
    motions = motions_of(scene.graspers)
    if is_led:
        stroke, motions = resting_stroke(stroke.pose(0.0)), [each.at_rest() for each in motions]
    needed = _needed(stroke, mesh, scene)
    if not stroke.is_led:
        _warn_of_table(stroke, table)
    boxes = bounds[None] if table is None else np.stack([bounds, table.bounds])
    rooms = [_room_of_grasper(motion, scene, bounds) for motion in motions]
    floor = [] if tissue.floor is None else [floor_below(bounds, tissue.floor)]
    around = [*fixtures, *floor]
    others: list[Standing] = []
    if scene.own_arm is None:
        placement, held, room = _placed(
            stroke,
            boxes,
            scene,
            needed,
            lambda place: _beside(place, stroke, scene, motions, boxes, rooms),
        )
        frame = TissueFrame(origin=placement.tissue_origin)
        others += [*held, *_in_world(table, around, frame)]
        arm: LedArm = placement.arm(others=others)
    else:
        arm, frame = _own(scene.own_arm)
        stroke = _as_long(stroke, arm.blade.length)
        room = _moved(arm, stroke, frame, workspace_in(scene, stroke.start, bounds))
        others += arms_with_graspers(scene.graspers, motions, boxes, frame, None, rooms)
        others += _in_world(table, around, frame)
        if others:
            start = np.array(arm.data.qpos)
            arm, _ = _own(scene.own_arm, others)
            arm.reset(start)
    _warn_of_weakness(needed, arm)
    standing = [each for each in others if isinstance(each, StandingFixture)]
    simulation = Simulation(
        arm,
        stroke,
        link,
        frame,
        [each.fixture for each in standing],
        tissue_every=scene.tissue_every,
        coupling=scene.virtual_coupling(),
        passivity=scene.passivity,
    )
    simulation.workspace = room
    if scene.graspers:
        _add_graspers(simulation, scene.graspers, motions, [each.body for each in standing])
    return simulation


def _add_graspers(
    simulation: Simulation,
    graspers: Sequence[GrasperTable],
    motions: Sequence[GraspMotion],
    fixtures: Sequence[str],
) -> None:
    """Have graspers take part, and all bodies of the arms but the blade touch the tissue.

    Args:
        simulation: Before its first frame.
        graspers: What the scene says of them.
        motions: Where they go.
        fixtures: Names of bodies that the tissue knows already.
    """
    arm, bridge = simulation.arm, simulation.bridge
    ours = [arm.model.body(arm.blade.body_id).name, *fixtures]
    simulation.partners.append(GeomCoupling(arm.data, bridge, without=ours))
    for grasper in led_graspers(graspers, motions, arm, bridge):
        simulation.add_grasper(grasper)


def _beside(
    placement: Placement,
    stroke: Stroke,
    scene: Scene,
    motions: Sequence[GraspMotion],
    boxes: FloatArray,
    rooms: Sequence[FloatArray | None],
) -> list[HeldArm]:
    """Return the arms with graspers beside an arm of the project; see `arms_with_graspers`."""
    frame = TissueFrame(origin=placement.tissue_origin)
    # Where a hand will lead it is not known: at the start the arms are clear of each other.
    known = resting_stroke(stroke.start) if stroke.is_led else stroke
    first = placement, known
    return arms_with_graspers(scene.graspers, motions, boxes, frame, first, rooms)


def _placed(
    stroke: Stroke,
    boxes: FloatArray,
    scene: Scene,
    needed: ExpectedForce,
    beside: Callable[[Placement], list[HeldArm]],
) -> tuple[Placement, list[HeldArm], FloatArray | None]:
    """Return where an arm of the project stands, arms beside it, and where a hand may lead it.

    Args:
        stroke: What it is to reach; of a hand, where it starts.
        boxes: See `placement.place`.
        scene: The scene.
        needed: What the cut will take.
        beside: Places the arms beside it.
    """
    if not stroke.is_led:
        placement = place(stroke, boxes, scene.arm, force=needed.force)
        return placement, beside(placement), None
    start = stroke.start
    workspace, middle = workspace_in(scene, start, boxes[0]), 0.5 * (start.tip + start.heel)

    def place_for(shares: FloatArray) -> tuple[Placement, list[HeldArm], FloatArray]:
        box = shrunk(workspace, middle, shares)
        tour = tour_of(box, middle, start)
        name = arm_for(scene.arm, shares)
        found = place_if_reached(tour, boxes, name, force=needed.force)
        if found is None:
            raise PlacementError(f"arm {name}")
        return found, beside(found), box

    def reaches(box: FloatArray) -> bool:
        return stays_in_reach(placement, tour_of(box, middle, start), boxes)

    try:
        placement, held, box = placed_within(place_for)
    except PlacementError as error:
        raise PlacementError(
            "no hand can lead the blade here: the arm does not reach around where the blade "
            "starts, in the direction that it has there. Choose another scene, or a first stroke "
            f"that begins with the blade upright ({error})"
        ) from error
    return placement, held, grown_within(box, workspace, reaches)


def _moved(
    arm: LedArm, stroke: Stroke, frame: TissueFrame, workspace: FloatArray
) -> FloatArray | None:
    """Move an arm of the user's own to the start, and return where a hand may lead it."""
    if stroke.is_led:
        return move_within(arm, workspace, stroke.start, frame)
    move_to_start(arm, stroke, frame)
    return None


def _room_of_grasper(motion: GraspMotion, scene: Scene, bounds: FloatArray) -> FloatArray | None:
    """Return where a hand is to lead a grasper; None where a script leads it."""
    if not motion.is_led:
        return None
    start = motion.stroke(HALF_PAD, HALF_PAD).start
    return workspace_in(scene, start, bounds, ROOM_OF_GRASPER)


def _as_long(stroke: Stroke, length: float) -> Stroke:
    """Return the stroke of a blade of that length [m].

    A hand has led this very blade where the lengths agree, and what was recorded keeps its bits.
    """
    is_same = math.isclose(stroke.blade_length, length, rel_tol=_SAME_LENGTH)
    if is_same and stroke.is_led:
        return stroke
    long = lengthened(stroke, length)
    return resting_stroke(long.start) if stroke.is_led else long


def _needed(stroke: Stroke, mesh: TetrahedralMesh, scene: Scene) -> ExpectedForce:
    """Return what the cut will take; nothing for a press, which is not to cut."""
    if stroke.name == "press":
        return ExpectedForce(0.0, 0.0)
    if stroke.is_led:  # its whole edge may be in the tissue
        return ExpectedForce(highest_toughness(scene) * stroke.blade_length, stroke.blade_length)
    return expected_force(stroke, mesh, highest_toughness(scene))


def _in_world(
    table: Tabletop | None, fixtures: Sequence[Fixture], frame: TissueFrame
) -> list[Standing]:
    """Return a table and fixtures of the tissue's frame where they stand in the world."""
    world = TissueFrame(
        frame.rotation.T, frame.points_to_tissue(np.zeros(3))
    )  # as the tissue sees it
    found: list[Standing] = [
        StandingFixture(world.fixture_to_tissue(fixture)) for fixture in fixtures
    ]
    return found if table is None else [table._replace(frame=frame), *found]


def _own(own: OwnArm, others: Sequence[Standing] = ()) -> tuple[LedArm, TissueFrame]:
    """Return an arm of the user's own, and where the tissue lies in its world."""
    limits = DeviceLimits(force=own.force or math.inf, torque=own.torque or math.inf)
    arm = own_arm(
        Path(own.model),
        limits,
        heel=own.heel,
        tip=own.tip,
        forward=own.forward,
        others=others,
    )
    quaternion, axes = np.array(own.quat), np.empty(9)
    if not quaternion.any():
        raise UsageError("[world] quat is [0, 0, 0, 0]; it is a rotation: w, x, y, z")
    mujoco.mju_quat2Mat(axes, quaternion / np.linalg.norm(quaternion))
    return arm, TissueFrame(axes.reshape(3, 3), np.array(own.pos))


def _warn_of_table(stroke: Stroke, table: Tabletop | None) -> None:
    """Say before the start that a stroke leads the edge into the table, which stops it."""
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


def _warn_of_weakness(needed: ExpectedForce, arm: LedArm) -> None:
    """Say before the start that an arm cannot do what it is asked to."""
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
