"""Places of the arms of a scene in the world: the one with the blade, and those with graspers."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from bridge import DeviceLimits, Fixture, TissueFrame
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.grasper import HALF_PAD, HeldArm
from scalpel_sim.arm.placement import (
    Placement,
    PlacementError,
    place,
    place_if_reached,
    stays_in_reach,
)
from scalpel_sim.arm.reachable_box import arm_for, grown_within, placed_within, shrunk, tour_of
from scalpel_sim.arm.standing import Standing, StandingFixture, Tabletop
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.own_arm import move_to_start, move_within, own_arm
from scalpel_sim.instruments.scene_graspers import arms_with_graspers
from scalpel_sim.scene.scene import Scene
from scalpel_sim.strokes.expected_force import ExpectedForce
from scalpel_sim.strokes.grasp_motion import GraspMotion
from scalpel_sim.strokes.sequence import lengthened
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray

_SAME_LENGTH = 1e-9
"""Share by which two lengths of one blade may differ, by rounding."""

ROOM = 0.02
"""Room around the body for the tip of a blade [m]: enough to lift it out and set it on elsewhere.
The larger of the arms reaches it around every body of the scenes whose blade stands upright; with
30 mm it would have little room left in its joints."""

ROOM_OF_GRASPER = 0.06
"""Room around the body for the tip of a grasper [m]: enough to lift what it holds, and to lay it
down beside the body."""


class ArmSurroundings(NamedTuple):
    """Surroundings of the arms, tissue frame."""

    boxes: FloatArray
    """Boxes that no arm may enter [m]: that of the body, and of a table; see `placement.place`."""
    table: Tabletop | None
    """Table under the body."""
    fixtures: list[Fixture]
    """Rigid bodies, a floor among them."""


class StandingArms(NamedTuple):
    """The arms of a scene at the start."""

    arm: DrivenArm
    """The one with the blade."""
    frame: TissueFrame
    """Where the tissue lies in its world."""
    stroke: Stroke
    """Its stroke, for a blade of its length."""
    others: list[Standing]
    """Other bodies in its world: arms with graspers, a table, fixtures."""
    room: FloatArray | None
    """Where a hand may lead the middle of its edge [m], tissue frame, shape (2, 3); None where a
    script leads it."""


def project_arm_in(
    scene: Scene,
    stroke: Stroke,
    motions: Sequence[GraspMotion],
    around: ArmSurroundings,
    needed: ExpectedForce,
) -> StandingArms:
    """Return an arm of the project where it reaches, and what stands beside it.

    Args:
        scene: The scene.
        stroke: What it is to reach; of a hand, where it starts.
        motions: Where the graspers go.
        around: What is in the way.
        needed: What the cut will take.

    Raises:
        PlacementError: there is no such place.
    """
    rooms = _rooms_of_graspers(motions, scene, around)
    placement, held, room = _placed(
        stroke,
        around.boxes,
        scene,
        needed,
        lambda place: _beside(place, stroke, scene, motions, around.boxes, rooms),
    )
    frame = TissueFrame(origin=placement.tissue_origin)
    others = [*held, *_in_world(around, frame)]
    return StandingArms(placement.arm(others=others), frame, stroke, others, room)


def own_arm_in(
    scene: Scene,
    stroke: Stroke,
    motions: Sequence[GraspMotion],
    around: ArmSurroundings,
) -> StandingArms:
    """Return the arm of the user's own at the start, and what stands beside it.

    Args:
        scene: The scene, which says where its tissue lies.
        stroke: What it is to reach; of a hand, where it starts.
        motions: Where the graspers go.
        around: What is in the way.

    Raises:
        ValueError: it cannot be read, or does not reach.
    """
    arm, frame = _own(scene)
    stroke = _as_long(stroke, arm.blade.length)
    room = _moved(arm, stroke, frame, workspace_in(scene, stroke.start, around.boxes[0]))
    rooms = _rooms_of_graspers(motions, scene, around)
    boxes = around.boxes
    others: list[Standing] = [
        *arms_with_graspers(scene.graspers, motions, boxes, frame, None, rooms),
        *_in_world(around, frame),
    ]
    if others:
        start = np.array(arm.data.qpos)
        arm, _ = _own(scene, others)
        arm.reset(start)
    return StandingArms(arm, frame, stroke, others, room)


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
        placement = place(stroke, boxes, scene.arm.preset, force=needed.force)
        return placement, beside(placement), None
    start = stroke.start
    workspace, middle = workspace_in(scene, start, boxes[0]), 0.5 * (start.tip + start.heel)

    def place_for(shares: FloatArray) -> tuple[Placement, list[HeldArm], FloatArray]:
        box = shrunk(workspace, middle, shares)
        tour = tour_of(box, middle, start)
        name = arm_for(scene.arm.preset, shares)
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
    arm: DrivenArm, stroke: Stroke, frame: TissueFrame, workspace: FloatArray
) -> FloatArray | None:
    """Move an arm of the user's own to the start, and return where a hand may lead it."""
    if stroke.is_led:
        return move_within(arm, workspace, stroke.start, frame)
    move_to_start(arm, stroke, frame)
    return None


def _rooms_of_graspers(
    motions: Sequence[GraspMotion], scene: Scene, around: ArmSurroundings
) -> list[FloatArray | None]:
    """Return where a hand is to lead each grasper; None where a script leads it."""
    return [_room_of_grasper(motion, scene, around.boxes[0]) for motion in motions]


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


def _in_world(around: ArmSurroundings, frame: TissueFrame) -> list[Standing]:
    """Return a table and fixtures of the tissue's frame where they stand in the world."""
    world = TissueFrame(
        frame.rotation.T, frame.points_to_tissue(np.zeros(3))
    )  # as the tissue sees it
    found: list[Standing] = [
        StandingFixture(world.fixture_to_tissue(fixture)) for fixture in around.fixtures
    ]
    return found if around.table is None else [around.table._replace(frame=frame), *found]


def _own(scene: Scene, others: Sequence[Standing] = ()) -> tuple[DrivenArm, TissueFrame]:
    """Return an arm of the user's own, and where the tissue lies in its world."""
    own, world = scene.arm, scene.world
    assert own.model is not None
    limits = DeviceLimits(force=own.force or math.inf, torque=own.torque or math.inf)
    arm = own_arm(
        Path(own.model),
        limits,
        heel=own.heel,
        tip=own.tip,
        forward=own.forward,
        others=others,
    )
    quaternion, axes = np.array(world.quat), np.empty(9)
    if not quaternion.any():
        raise UsageError("[world] quat is [0, 0, 0, 0]; it is a rotation: w, x, y, z")
    mujoco.mju_quat2Mat(axes, quaternion / np.linalg.norm(quaternion))
    return arm, TissueFrame(axes.reshape(3, 3), np.array(world.pos))


def workspace(
    start: BladeSegment, bounds: FloatArray, lowest: float, room: float = ROOM
) -> FloatArray:
    """Return the lowest and the highest place of the middle of the edge [m], shape (2, 3).

    There the tip is in the body, or a little beside or above it, with the edge as at the start; the
    start lies in it wherever it is.

    Args:
        start: The pose of the blade at the start, tissue frame; of a grasper, its pads as an edge.
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
        lowest: Height of what lies under the body [m]; minus infinity: nothing.
        room: How far the tip may be beside the body or above it [m].
    """
    low, high = bounds[0] - room, bounds[1] + room
    low[2] = max(low[2], lowest)
    to_middle = 0.5 * (start.heel - start.tip)
    return np.stack([np.minimum(low, start.tip), np.maximum(high, start.tip)]) + to_middle


def workspace_in(
    scene: Scene, start: BladeSegment, bounds: FloatArray, room: float = ROOM
) -> FloatArray:
    """Return the workspace around the body of a scene: not under its table or floor.

    Args:
        scene: The scene.
        start: See `workspace`, as the rest.
        bounds: Lowest and highest corner of the body [m].
        room: How far the tip may be beside it [m].
    """
    stops = [height for height in (scene.world.table, scene.world.floor) if height is not None]
    return workspace(start, bounds, max(stops, default=-math.inf), room)


def resting_stroke(start: BladeSegment) -> Stroke:
    """Return the stroke of a blade that rests until a hand leads it."""
    return Stroke([0.0, 1.0], [start, start], "live hand", is_led=True)
