"""An arm of the user's own: any MJCF or URDF, led by a hand at the edge of its blade.

The hand is Cartesian impedance control at the blade, with gravity compensated, as robot arms offer
it: it acts through the joints, whatever they are. The model's own actuators are taken out, for they
would hold the joints where they are.
"""

import logging
from collections.abc import Sequence
from pathlib import Path
from typing import Final, NamedTuple

import mujoco
import numpy as np

from bridge import DeviceLimits, TissueFrame
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.chain_kinematics import ChainKinematics
from scalpel_sim.arm.grasper import FORWARD
from scalpel_sim.arm.hand import Impedance
from scalpel_sim.arm.model_file import spec_of_file
from scalpel_sim.arm.overlaps import first_configuration, in_words, pass_where_they_overlap
from scalpel_sim.arm.placement import PlacementError
from scalpel_sim.arm.reachable_box import SMALLEST_SHARE, reachable_part
from scalpel_sim.arm.scalpel import HEEL, TIP, add_scalpel
from scalpel_sim.arm.standing import Standing
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.lacking_reach import PlaceInScene, place_of_tissue, what_it_lacks
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, BladeShape, FloatArray

_SAMPLES: Final = 33
"""Poses along the stroke that the arm must reach."""

_log = logging.getLogger("scalpel_sim")


class Mount(NamedTuple):
    """A scalpel that a model without a blade holds."""

    at: str
    """Site, body or frame that holds it along its +z."""
    blade: BladeShape
    """Its cross-section."""
    length: float
    """Length of its edge [m]."""
    forward: Sequence[float] = (0.0, 1.0, 0.0)
    """Direction in which the edge cuts, in the frame of the place."""


def own_arm(
    path: Path,
    limits: DeviceLimits,
    *,
    impedance: Impedance = Impedance(),
    mount: Mount | None = None,
    heel: str = "heel",
    tip: str = "tip",
    forward: Sequence[float] = (0.0, 0.0, -1.0),
    others: Sequence[Standing] = (),
) -> DrivenArm:
    """Return the arm of a file, in the configuration of its first keyframe if it has one.

    Args:
        path: The file. Without a mount it needs two sites at the ends of the edge, on one body.
        limits: Largest force and torque that the arm can render.
        impedance: How firmly its hand holds the blade.
        mount: Scalpel that it holds; its edge then is that of the arm. None: it has a blade.
        heel: Site at the handle's end of the edge.
        tip: Site at the sharp end.
        forward: Direction in which the edge cuts, in the frame of its body.
        others: What else stands in its world: arms, each with a grasper, a table, fixtures.

    Raises:
        UsageError: the file cannot be read, is no model, or has no such blade.
    """
    try:
        spec = own_spec(path)
        if mount is not None:
            prefix = add_scalpel(
                spec, mount.at, mount.blade, length=mount.length, forward=mount.forward
            )
            heel, tip, forward = prefix + HEEL, prefix + TIP, FORWARD
        pass_where_they_overlap(spec, path.stem)
        arm = DrivenArm(
            spec,
            path.stem,
            limits,
            impedance,
            heel=heel,
            tip=tip,
            forward=forward,
            others=others,
        )
        expect_angles(arm.model)
    except ValueError as error:
        raise UsageError(f"[arm] model {path}: {error}") from error
    arm.reset(first_configuration(arm.model)[: len(arm.ranges()[0])])
    return arm


def own_spec(path: Path) -> mujoco.MjSpec:
    """Return the model of a file without its actuators, its gravity compensated.

    What measures an actuator goes with it.

    Raises:
        ValueError: the file cannot be read, or is no model.
    """
    spec = spec_of_file(path)
    for sensor in list(spec.sensors):
        if mujoco.mjtObj.mjOBJ_ACTUATOR in (sensor.objtype, sensor.reftype):
            spec.delete(sensor)
    for actuator in list(spec.actuators):
        spec.delete(actuator)
    for key in list(spec.keys):
        key.ctrl, key.act = [], []  # of the actuators that are gone
    for body in spec.bodies:
        body.gravcomp = 1.0
    # A bad state must raise, not jump back to the start.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    return spec


def expect_angles(model: mujoco.MjModel) -> None:
    """Refuse joints whose position is not one number.

    Raises:
        ValueError: one is no hinge and no slide.
    """
    others = {int(mujoco.mjtJoint.mjJNT_BALL): "ball", int(mujoco.mjtJoint.mjJNT_FREE): "free"}
    found = [
        f"'{model.joint(i).name}' of body '{model.body(int(model.jnt_bodyid[i])).name}' ({word})"
        for i in range(model.njnt)
        if (word := others.get(int(model.jnt_type[i])))
    ]
    if found:
        raise ValueError(
            f"it has other joints than hinges and slides: {', '.join(found)}. Three hinges make a "
            "ball; what is loose cannot be part of an arm"
        )


def frame_at(pos: Sequence[float], quat: Sequence[float]) -> TissueFrame:
    """Return the frame at a place [m] with a rotation (w, x, y, z) of any length but 0."""
    axes, quaternion = np.empty(9), np.array(quat)
    mujoco.mju_quat2Mat(axes, quaternion / np.linalg.norm(quaternion))
    return TissueFrame(axes.reshape(3, 3), np.array(pos))


def move_to_start(
    arm: DrivenArm, stroke: Stroke, frame: TissueFrame, place: PlaceInScene | None = None
) -> None:
    """Move an arm to the start of a stroke, all of which it must reach.

    Args:
        arm: The arm; the configuration where it is is tried first.
        stroke: In the tissue frame.
        frame: Where the tissue lies in the world.
        place: How the scene says so; None: as `frame` does.

    Raises:
        PlacementError: it does not; the message says by how much and in which direction, and where
            it would, or which motion the arm lacks.
    """
    times, poses = _watched(stroke, frame)
    solver = ChainKinematics(arm)
    found = solver.find_clear(poses)
    if not found.is_whole:
        lacks = what_it_lacks(solver, times, poses, place or place_of_tissue(frame))
        raise PlacementError(f"the arm '{arm.name}' does not reach the stroke: {lacks}")
    if found.overlaps:
        _log.warning(
            "the arm '%s' cannot do the stroke clear of itself and of what stands in its model, "
            "which bends its path: there overlap %s. Move or turn the tissue",
            arm.name,
            in_words(found.overlaps),
        )
    arm.reset(found.first)


def move_within(
    arm: DrivenArm,
    workspace: FloatArray,
    start: BladeSegment,
    frame: TissueFrame,
    place: PlaceInScene | None = None,
) -> FloatArray:
    """Move an arm to a pose, and return how much of the workspace around it it reaches.

    Args:
        arm: See `move_to_start`.
        workspace: Lowest and highest place where the middle of the edge is wanted, tissue frame
            [m], shape (2, 3).
        start: The pose, tissue frame.
        frame: Where the tissue lies in the world.
        place: See `move_to_start`.

    Raises:
        PlacementError: it does not reach even a small part of it.
    """

    def move(tour: Stroke, shares: FloatArray) -> None:
        found = ChainKinematics(arm).find_clear(_watched(tour, frame)[1])
        if not found.is_whole:
            if shares.max() <= SMALLEST_SHARE:  # the last that is tried: say what it lacks
                move_to_start(arm, tour, frame, place)
            raise PlacementError(f"the arm '{arm.name}' does not reach the stroke")
        arm.reset(found.first)

    def reaches(_: None, tour: Stroke) -> bool:
        solver = ChainKinematics(arm)
        return solver.follow(solver.starts()[0], _watched(tour, frame)[1]).is_whole

    middle = 0.5 * (start.tip + start.heel)
    return reachable_part(workspace, middle, start, move, reaches)[1]


def _watched(stroke: Stroke, frame: TissueFrame) -> tuple[FloatArray, list[BladeSegment]]:
    """Return the instants at which an arm must reach a stroke [s], and the poses, world frame."""
    times = np.linspace(0.0, stroke.duration, _SAMPLES)
    return times, [frame.segment_to_world(stroke.pose(t)) for t in times]
