"""Places of the arms of a scene in the world: the one with the blade, and those with graspers."""

import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import msgspec
import numpy as np

from bridge import DeviceLimits, Fixture, TissueFrame
from scalpel_sim.arm.arm import PSM, DrivenArm
from scalpel_sim.arm.firm_hand import damping_of_self_motion, firm_impedance
from scalpel_sim.arm.grasper import HALF_PAD, HeldArm
from scalpel_sim.arm.hand import Impedance
from scalpel_sim.arm.placement import (
    Placement,
    PlacementError,
    place,
    place_if_reached,
    stays_in_reach,
)
from scalpel_sim.arm.reachable_box import arm_for, reachable_part
from scalpel_sim.arm.standing import Standing, StandingFixture, Tabletop
from scalpel_sim.instruments.own_arm import (
    Mount,
    frame_at,
    move_to_start,
    move_within,
    own_arm,
)
from scalpel_sim.instruments.scene_graspers import arms_with_graspers
from scalpel_sim.scene.arm_tables import ArmTable, GrasperTable
from scalpel_sim.scene.blade import SCALPEL
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
down next to the body."""


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
    """Return an arm of the project where it reaches, and what stands next to it.

    Args:
        scene: The scene.
        stroke: What it is to reach; of a hand, where it starts.
        motions: Where the graspers go.
        around: What is in the way.
        needed: What the cut will take.

    Raises:
        PlacementError: there is no such place.
    """
    boxes, start = around.boxes, stroke.start
    preset, trocar = scene.arm.preset, scene.arm.trocar
    rooms = _rooms_of_graspers(motions, scene, around)
    graspers = [_alike(grasper, preset) for grasper in scene.graspers]
    # Where a hand will lead it is not known: at the start the arms are clear of each other.
    known = resting_stroke(start) if stroke.is_led else stroke

    def beside(placement: Placement) -> tuple[Placement, list[HeldArm]]:
        frame = TissueFrame(origin=placement.tissue_origin)
        held = arms_with_graspers(graspers, motions, boxes, frame, (placement, known), rooms)
        return placement, held

    def place_for(tour: Stroke, shares: FloatArray) -> tuple[Placement, list[HeldArm]]:
        name = arm_for(preset, shares)
        found = place_if_reached(tour, boxes, name, force=needed.force, trocar=trocar)
        if found is None:
            raise PlacementError(f"arm {name}")
        return beside(found)

    def reaches(found: tuple[Placement, list[HeldArm]], tour: Stroke) -> bool:
        return stays_in_reach(found[0], tour, boxes)

    room = None
    if stroke.is_led:
        wanted, middle = workspace_in(scene, start, boxes[0]), 0.5 * (start.tip + start.heel)
        try:
            found, room = reachable_part(wanted, middle, start, place_for, reaches)
        except PlacementError as error:
            raise PlacementError(
                "no hand can lead the blade here: the arm does not reach around where the blade "
                "starts, in the direction that it has there. Choose another scene, or a first "
                f"stroke that begins with the blade upright ({error})"
            ) from error
    else:
        found = beside(place(stroke, boxes, preset, force=needed.force, trocar=trocar))
    placement, held = found
    frame = TissueFrame(origin=placement.tissue_origin)
    others = [*held, *standing_around(around, frame)]
    return StandingArms(placement.arm(others=others), frame, stroke, others, room)


def _alike(grasper: GrasperTable, preset: str) -> GrasperTable:
    """Return a grasper on an arm like that with the blade, where the scene leaves it open."""
    if preset == PSM and grasper.preset is None and grasper.model is None:
        return msgspec.structs.replace(grasper, preset=PSM)
    return grasper


def own_arm_in(
    scene: Scene,
    stroke: Stroke,
    motions: Sequence[GraspMotion],
    around: ArmSurroundings,
) -> StandingArms:
    """Return the arm of the user's own at the start, and what stands next to it.

    Args:
        scene: The scene, which says where its tissue lies.
        stroke: What it is to reach; of a hand, where it starts.
        motions: Where the graspers go.
        around: What is in the way.

    Raises:
        ValueError: it cannot be read, or does not reach.
    """
    arm, frame = _own(scene, stroke.blade_length)
    stroke = _as_long(stroke, arm.blade.length)
    room = None
    if stroke.is_led:
        wanted = workspace_in(scene, stroke.start, around.boxes[0])
        room = move_within(arm, wanted, stroke.start, frame)
    else:
        move_to_start(arm, stroke, frame)
    rooms = _rooms_of_graspers(motions, scene, around)
    boxes = around.boxes
    others: list[Standing] = [
        *arms_with_graspers(scene.graspers, motions, boxes, frame, None, rooms),
        *standing_around(around, frame),
    ]
    start, damping = np.array(arm.data.qpos), damping_of_self_motion(arm)
    arm, _ = _own(scene, stroke.blade_length, firm_impedance(arm), others)
    arm.model.dof_damping[: len(damping)] += damping  # all joints are hinges or slides
    arm.reset(start)
    return StandingArms(arm, frame, stroke, others, room)


def _rooms_of_graspers(
    motions: Sequence[GraspMotion], scene: Scene, around: ArmSurroundings
) -> list[FloatArray | None]:
    """Return where a hand is to lead each grasper; None where a script leads it."""
    starts = [m.stroke(HALF_PAD, HALF_PAD).start if m.is_led else None for m in motions]
    bounds = around.boxes[0]
    return [
        None if start is None else workspace_in(scene, start, bounds, ROOM_OF_GRASPER)
        for start in starts
    ]


def _as_long(stroke: Stroke, length: float) -> Stroke:
    """Return the stroke of a blade of that length [m].

    A hand has led this very blade where the lengths agree, and what was recorded keeps its bits.
    """
    is_same = math.isclose(stroke.blade_length, length, rel_tol=_SAME_LENGTH)
    if is_same and stroke.is_led:
        return stroke
    long = lengthened(stroke, length)
    return resting_stroke(long.start) if stroke.is_led else long


def standing_around(around: ArmSurroundings, frame: TissueFrame) -> list[Standing]:
    """Return a table and fixtures of the tissue's frame where they stand in the world."""
    world = TissueFrame(
        frame.rotation.T, frame.points_to_tissue(np.zeros(3))
    )  # as the tissue sees it
    found: list[Standing] = [
        StandingFixture(world.fixture_to_tissue(fixture)) for fixture in around.fixtures
    ]
    return found if around.table is None else [around.table._replace(frame=frame), *found]


def _own(
    scene: Scene,
    length: float,
    impedance: Impedance = Impedance(),
    others: Sequence[Standing] = (),
) -> tuple[DrivenArm, TissueFrame]:
    """Return an arm of the user's own, and where the tissue lies in its world.

    Args:
        scene: The scene.
        length: Length of the edge of a scalpel that it holds [m]; a blade of its own has its own.
        impedance: How firmly its hand holds the blade.
        others: What else stands in its world.
    """
    own, world = scene.arm, scene.world
    assert own.model is not None
    limits = DeviceLimits(force=own.force or math.inf, torque=own.torque or math.inf)
    mount = None
    if own.mount is not None:
        mount = Mount(own.mount, scene.blade or SCALPEL, length)
        if own.forward != ArmTable().forward:
            mount = mount._replace(forward=own.forward)
    arm = own_arm(
        Path(own.model),
        limits,
        impedance=impedance,
        mount=mount,
        heel=own.heel,
        tip=own.tip,
        forward=own.forward,
        others=others,
    )
    return arm, frame_at(world.pos, world.quat)


def workspace_in(
    scene: Scene, start: BladeSegment, bounds: FloatArray, room: float = ROOM
) -> FloatArray:
    """Return the lowest and the highest place of the middle of the edge [m], shape (2, 3).

    There the tip is in the body of the scene, or a little next to or above it, with the edge as at
    the start, and not under its table or floor; the start lies in it wherever it is.

    Args:
        scene: The scene.
        start: The pose of the blade at the start, tissue frame; of a grasper, its pads as an edge.
        bounds: Lowest and highest corner of the body [m], shape (2, 3).
        room: How far the tip may be next to the body or above it [m].
    """
    low, high = bounds[0] - room, bounds[1] + room
    low[2] = max(low[2], scene.world.stop)
    to_middle = 0.5 * (start.heel - start.tip)
    return np.stack([np.minimum(low, start.tip), np.maximum(high, start.tip)]) + to_middle


def resting_stroke(start: BladeSegment) -> Stroke:
    """Return the stroke of a blade that rests until a hand leads it."""
    return Stroke([0.0, 1.0], [start, start], "live hand", is_led=True)
