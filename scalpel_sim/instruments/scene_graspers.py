"""From the graspers of a scene to arms that hold them, and to what leads them.

An arm is one of the presets, or a model of the user's own.
"""

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from bridge import DeviceLimits, TissueFrame
from scalpel_sim.arm.arm import ARMS, PSM, DrivenArm, preset_spec, put_base
from scalpel_sim.arm.firm_hand import firm_impedance
from scalpel_sim.arm.grasper import (
    FORWARD,
    GRASPER,
    HALF_PAD,
    PADS_HEEL,
    PADS_TIP,
    SHAFT_LENGTH,
    SHORT_SHAFT,
    Grasper,
    HeldArm,
    add_grasper,
    grasper_spec,
)
from scalpel_sim.arm.hand import Impedance, add_hand
from scalpel_sim.arm.kinematics import Spheres
from scalpel_sim.arm.overlaps import pass_where_they_overlap
from scalpel_sim.arm.placement import (
    AUTO,
    SAMPLES,
    Neighbours,
    Placement,
    Trocar,
    covered,
    place_beside,
    stays_in_reach,
)
from scalpel_sim.arm.psm_kinematics import WRIST_LEVER
from scalpel_sim.arm.reachable_box import arm_for, reachable_part
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.driven_grasper import GripSettings
from scalpel_sim.instruments.lacking_reach import place_of_arm
from scalpel_sim.instruments.own_arm import (
    expect_angles,
    frame_at,
    move_to_start,
    move_within,
    own_spec,
)
from scalpel_sim.scene.arm_tables import DEFAULT_ACROSS, DEFAULT_APPROACH, GrasperTable
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint, grasp_from_csv
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray

WATCHED_INSTANTS = 33
"""Instants at which arms must reach and be clear of each other: between two of them a hand that
crosses the scene in a second moves by less than a link is thick."""


def motions_of(graspers: Sequence[GrasperTable]) -> list[GraspMotion]:
    """Return the motions of graspers; what a row leaves out is as in the row before.

    Raises:
        StrokeError: no grasper can follow one, or a file that holds one is wrong.
    """
    return [
        GraspMotion(_waypoints(grasper), grasper.name)
        if grasper.recorded is None
        else grasp_from_csv(grasper.recorded, grasper.name)
        for grasper in graspers
    ]


def _waypoints(grasper: GrasperTable) -> list[Waypoint]:
    """Return the rows of a motion, complete."""
    now = Waypoint(0.0, (0.0, 0.0, 0.0), DEFAULT_APPROACH, DEFAULT_ACROSS, 0.0)
    found = []
    for row in grasper.motion:
        given = {name: getattr(row, name) for name in Waypoint._fields}
        now = now._replace(**{name: value for name, value in given.items() if value is not None})
        found.append(now)
    return found


def arms_with_graspers(
    graspers: Sequence[GrasperTable],
    motions: Sequence[GraspMotion],
    boxes: FloatArray,
    frame: TissueFrame,
    first: tuple[Placement, Stroke] | None,
    workspaces: Sequence[FloatArray | None],
) -> list[HeldArm]:
    """Return the arms that hold the graspers of a scene, each clear of those before.

    Args:
        graspers: What the scene says of them.
        motions: Where they go, tissue frame.
        boxes: Lowest and highest corners of what lies there, tissue frame [m]; see
            `placement.place`.
        frame: Where the tissue lies in the world.
        first: Where an arm of the project stands that does a stroke, and that stroke; its table is
            that of all. None: there is none, and each arm has its own table.
        workspaces: Where a hand is to lead each: see `HeldArm.workspace`; None: it follows its
            script.

    Raises:
        UsageError: a model cannot be read, or has no place for a grasper.
        PlacementError: an arm does not reach its motion.
    """
    last = max([motion.duration for motion in motions if not motion.is_led], default=0.0)
    if first is not None:
        last = max(last, first[1].duration)
    times = np.linspace(0.0, last, WATCHED_INSTANTS)
    beside = Neighbours(boxes, times)
    if first is not None:
        table, there = -float(first[0].tissue_origin[2]), covered(*first, boxes, times)
        beside = beside._replace(table=table, others=(there,))
    found = []
    for grasper, motion, workspace in zip(graspers, motions, workspaces, strict=True):
        if grasper.model is None:
            preset = grasper.preset or AUTO
            place, spheres, reached = place_of_grasper(
                motion, preset, beside, workspace, grasper.trocar
            )
            beside = beside._replace(others=(*beside.others, spheres))
            arm = preset_with_grasper(motion, place, frame, force=grasper.force, workspace=reached)
        else:
            arm = model_with_grasper(motion, grasper, frame, workspace)
        found.append(arm)
    return found


def place_of_grasper(
    motion: GraspMotion,
    preset: str,
    beside: Neighbours,
    workspace: FloatArray | None = None,
    trocar: Trocar | None = None,
) -> tuple[Placement, Spheres, FloatArray | None]:
    """Return where an arm of the project stands, what covers it, and where a hand may lead it.

    Where a hand leads its grasper, it is clear of other arms at the start; where hands lead them is
    not known.

    Args:
        motion: Where the grasper goes; of a hand, where it starts.
        preset: The arm.
        beside: What it stands next to.
        workspace: Where a hand is to lead it, see `HeldArm.workspace`; None: it follows its script.
        trocar: Where the remote centre of a `psm` is [m]; None: where it reaches best.

    Raises:
        PlacementError: it does not reach its motion, or even a small part of the workspace.
    """
    path, reached = path_of_grasper(motion, preset), None
    if workspace is None:
        place = place_beside(path, preset, beside, trocar=trocar)
    else:

        def place_for(tour: Stroke, shares: FloatArray) -> Placement:
            there = beside._replace(times=np.linspace(0.0, tour.duration, SAMPLES))
            name = arm_for(preset, shares)
            return place_beside(tour, name, there, at_start=True, trocar=trocar)

        def reaches(place: Placement, tour: Stroke) -> bool:
            return stays_in_reach(place, tour, beside.boxes)

        middle = np.array(motion.start.at)
        place, reached = reachable_part(workspace, middle, path.start, place_for, reaches)
    return place, covered(place, path, beside.boxes, beside.times), reached


def path_of_grasper(motion: GraspMotion, preset: str = AUTO) -> Stroke:
    """Return a motion as that of an edge from where a preset holds it to the end of its pads."""
    return motion.stroke(_shaft_length(preset), HALF_PAD)


def _shaft_length(preset: str) -> float:
    """Return the distance from where a preset holds a grasper to the middle of its pads [m]."""
    return SHORT_SHAFT if preset == PSM else SHAFT_LENGTH


def preset_with_grasper(
    motion: GraspMotion,
    placement: Placement,
    frame: TissueFrame,
    *,
    force: float | None = None,
    workspace: FloatArray | None = None,
) -> HeldArm:
    """Return an arm of the project that holds a grasper, at the start of a motion.

    Args:
        motion: Where the grasper goes; its name is that of the grasper.
        placement: Where the arm stands.
        frame: Where the tissue lies in the world.
        force: Largest force of the jaws [N]; None: the usual.
        workspace: See `HeldArm.workspace`.
    """
    heel, tip = GRASPER + PADS_HEEL, GRASPER + PADS_TIP
    qpos, impedance = np.append(placement.qpos, 2 * [0.5 * motion.opening(0.0)]), Impedance()
    if placement.preset == PSM:
        alone = DrivenArm(
            _preset_holding(placement, force), PSM, ARMS[PSM], heel=heel, tip=tip, forward=FORWARD
        )
        alone.reset(qpos)
        impedance = firm_impedance(alone, lever=WRIST_LEVER)
    spec = _preset_holding(placement, force)
    hand = add_hand(spec, impedance, heel, tip, FORWARD)
    origin = frame.points_to_world(-placement.tissue_origin)
    turned = _quaternion(frame.rotation)
    return HeldArm(motion.name, spec, qpos, origin, turned, hand, workspace=workspace)


def _preset_holding(placement: Placement, force: float | None) -> mujoco.MjSpec:
    """Return the model of an arm of the project with a grasper in place of the blade.

    Args:
        placement: Where the arm stands.
        force: Largest force of the jaws [N]; None: the usual.
    """
    spec = preset_spec(placement.preset)
    put_base(spec, placement.base_position, placement.base_yaw)
    blade, half = spec.body("blade"), 0.5 * placement.mount_angle
    turned = [math.cos(half), math.sin(half), 0.0, 0.0]
    place = blade.parent.add_frame(pos=blade.pos, quat=turned)
    spec.delete(blade)
    grasper = grasper_spec(spec, force, _shaft_length(placement.preset))
    spec.attach(grasper, prefix=GRASPER, frame=place)
    return spec


def model_with_grasper(
    motion: GraspMotion,
    grasper: GrasperTable,
    frame: TissueFrame,
    workspace: FloatArray | None = None,
) -> HeldArm:
    """Return the arm of an MJCF file that holds a grasper, at the start of a motion.

    Args:
        motion: Where the grasper goes; its name is that of the grasper.
        grasper: Gives the file, what of it holds the grasper, its place, and the force of the jaws.
        frame: Where the tissue lies in the world.
        workspace: Where a hand is to lead the middle of the pads [m]; None: a script leads it.

    Raises:
        UsageError: the file cannot be read, is no model, or has no such site or body.
        PlacementError: the arm does not reach the whole motion.
    """
    assert grasper.model is not None and grasper.at is not None
    path, at, where = Path(grasper.model), grasper.at, f"[[grasper]] '{motion.name}'"
    base = frame_at(grasper.pos or (0.0, 0.0, 0.0), grasper.quat or (1.0, 0.0, 0.0, 0.0))

    def with_grasper() -> tuple[mujoco.MjSpec, str]:
        spec = own_spec(path)
        prefix = add_grasper(spec, at, force=grasper.force)
        pass_where_they_overlap(spec, path.stem)
        return spec, prefix

    try:
        spec, prefix = with_grasper()
        heel, tip = prefix + PADS_HEEL, prefix + PADS_TIP
        alone = DrivenArm(spec, path.stem, DeviceLimits(), heel=heel, tip=tip, forward=FORWARD)
        expect_angles(alone.model)
    except ValueError as error:
        raise UsageError(f"{where} model {path}: {error}") from error
    tissue_in_model = TissueFrame(base.rotation.T, base.points_to_tissue(np.zeros(3)))
    stroke = motion.stroke(HALF_PAD, HALF_PAD)
    place = place_of_arm(where, base)
    if workspace is None:
        move_to_start(alone, stroke, tissue_in_model, place)
    else:
        workspace = move_within(alone, workspace, stroke.start, tissue_in_model, place)
    spec, _ = with_grasper()
    hand = add_hand(spec, firm_impedance(alone), heel, tip, FORWARD)
    Grasper(alone.model, alone.data, prefix).put_to(motion.opening(0.0))
    qpos = np.array(alone.data.qpos)
    turned = _quaternion(frame.rotation @ base.rotation)
    origin = frame.points_to_world(base.origin)
    return HeldArm(motion.name, spec, qpos, origin, turned, hand, prefix, workspace)


def grip_settings(table: GrasperTable) -> GripSettings | None:
    """Return how a grasper holds what its jaws close on; None: by friction alone."""
    if table.holds == "friction":
        return None
    given = {name: getattr(table, name) for name in GripSettings._fields}
    return GripSettings()._replace(
        **{name: value for name, value in given.items() if value is not None}
    )


def _quaternion(rotation: FloatArray) -> FloatArray:
    """Return a rotation as (w, x, y, z)."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    return quaternion
