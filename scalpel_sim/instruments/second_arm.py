"""An arm that holds a grasper: one of the presets, or a model of the user's own."""

import math
from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from bridge import DeviceLimits, TissueFrame
from scalpel_sim.arm.arm import DrivenArm, preset_spec, put_base
from scalpel_sim.arm.grasper import (
    FORWARD,
    GRASPER,
    HALF_PAD,
    PADS_HEEL,
    PADS_TIP,
    SHAFT_LENGTH,
    Grasper,
    HeldArm,
    add_grasper,
    grasper_spec,
)
from scalpel_sim.arm.hand import Impedance, add_hand
from scalpel_sim.arm.place_search import Spheres
from scalpel_sim.arm.placement import (
    SAMPLES,
    Placement,
    covered,
    place_beside,
    stays_in_reach,
)
from scalpel_sim.arm.reachable_box import arm_for, grown_within, placed_within, shrunk, tour_of
from scalpel_sim.errors import UsageError
from scalpel_sim.instruments.lacking_reach import place_of_arm
from scalpel_sim.instruments.own_arm import (
    expect_angles,
    firm_impedance,
    move_to_start,
    move_within,
    own_spec,
)
from scalpel_sim.strokes.grasp_motion import GraspMotion
from scalpel_sim.strokes.stroke import Stroke
from tissue import FloatArray


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
    spec = preset_spec(placement.preset)
    put_base(spec, placement.base_position, placement.base_yaw)
    stylus, blade = spec.body("stylus"), spec.body("blade")
    half = 0.5 * placement.mount_angle
    place = stylus.add_frame(pos=blade.pos, quat=[math.cos(half), math.sin(half), 0.0, 0.0])
    spec.delete(blade)
    spec.attach(grasper_spec(spec, force), prefix=GRASPER, frame=place)
    hand = add_hand(spec, Impedance(), GRASPER + PADS_HEEL, GRASPER + PADS_TIP, FORWARD)
    qpos = np.append(placement.qpos, 2 * [0.5 * motion.opening(0.0)])
    origin = frame.points_to_world(-placement.tissue_origin)
    turned = _quaternion(frame.rotation)
    return HeldArm(motion.name, spec, qpos, origin, turned, hand, workspace=workspace)


def place_of_grasper(
    motion: GraspMotion,
    boxes: FloatArray,
    preset: str,
    times: FloatArray,
    *,
    table: float | None,
    others: Sequence[Spheres],
) -> tuple[Placement, Spheres]:
    """Return where an arm of the project stands that holds a grasper, and what covers it.

    Args:
        motion: Where the grasper goes.
        boxes: See `place_beside`, as the rest.
        preset: The arm.
        times: Instants [s].
        table: Height of the table.
        others: What covers other arms.
    """
    path = path_of_grasper(motion)
    place = place_beside(path, boxes, preset, times, table=table, others=others)
    return place, covered(place, path, boxes, times, edge_height=0.0)


def place_of_driven_grasper(
    motion: GraspMotion,
    workspace: FloatArray,
    boxes: FloatArray,
    preset: str,
    times: FloatArray,
    *,
    table: float | None,
    others: Sequence[Spheres],
) -> tuple[Placement, Spheres, FloatArray]:
    """Return where an arm stands whose grasper a hand leads, what covers it, and where it reaches.

    It is clear of other arms at the start; where hands lead them is not known.

    Args:
        motion: Where the grasper is at the start.
        workspace: Where it is wanted, see `HeldArm.workspace`.
        boxes: See `place_of_grasper`, as the rest.
        preset: The arm.
        times: Instants at which what covers it is wanted [s].
        table: Height of the table.
        others: What covers other arms.

    Raises:
        PlacementError: it does not reach even a small part of the workspace.
    """
    path, middle = path_of_grasper(motion), np.array(motion.start.at)

    def place_for(shares: FloatArray) -> tuple[Placement, FloatArray]:
        box = shrunk(workspace, middle, shares)
        tour = tour_of(box, middle, path.start)
        instants = np.linspace(0.0, tour.duration, SAMPLES)
        name = arm_for(preset, shares)
        found = place_beside(tour, boxes, name, instants, table=table, others=others, at_start=True)
        return found, box

    def reaches(larger: FloatArray) -> bool:
        return stays_in_reach(place, tour_of(larger, middle, path.start), boxes, edge_height=0.0)

    place, box = placed_within(place_for)
    spheres = covered(place, path, boxes, times, edge_height=0.0)
    return place, spheres, grown_within(box, workspace, reaches)


def path_of_grasper(motion: GraspMotion) -> Stroke:
    """Return a motion as that of an edge from where an arm holds it to the end of its pads."""
    return motion.stroke(SHAFT_LENGTH, HALF_PAD)


def model_with_grasper(
    motion: GraspMotion,
    path: Path,
    at: str,
    base: TissueFrame,
    frame: TissueFrame,
    *,
    force: float | None = None,
    workspace: FloatArray | None = None,
) -> HeldArm:
    """Return the arm of an MJCF file that holds a grasper, at the start of a motion.

    Args:
        motion: Where the grasper goes; its name is that of the grasper.
        path: The file.
        at: Site or body that holds the grasper, along its +z.
        base: Where the origin of the model lies in the frame of the tissue.
        frame: Where the tissue lies in the world.
        force: Largest force of the jaws [N]; None: the usual.
        workspace: Where a hand is to lead the middle of the pads [m]; None: a script leads it.

    Raises:
        UsageError: the file cannot be read, is no model, or has no such site or body.
        PlacementError: the arm does not reach the whole motion.
    """

    def with_grasper() -> tuple[mujoco.MjSpec, str]:
        spec = own_spec(path)
        return spec, add_grasper(spec, at, force=force)

    try:
        spec, prefix = with_grasper()
        heel, tip = prefix + PADS_HEEL, prefix + PADS_TIP
        alone = DrivenArm(spec, path.stem, DeviceLimits(), heel=heel, tip=tip, forward=FORWARD)
        expect_angles(alone.model)
    except ValueError as error:
        raise UsageError(f"[[grasper]] '{motion.name}' model {path}: {error}") from error
    tissue_in_model = TissueFrame(base.rotation.T, base.points_to_tissue(np.zeros(3)))
    stroke = motion.stroke(HALF_PAD, HALF_PAD)
    place = place_of_arm(f"[[grasper]] '{motion.name}'", base)
    if workspace is None:
        move_to_start(alone, stroke, tissue_in_model, place)
    else:
        workspace = move_within(alone, workspace, stroke.start, tissue_in_model, place)
    spec, _ = with_grasper()
    hand = add_hand(spec, firm_impedance(alone), heel, tip, FORWARD)
    Grasper(alone.model, alone.data, prefix).put_to(motion.opening(0.0))
    qpos = np.array(alone.data.qpos)
    turned = frame.rotation @ base.rotation
    origin = frame.points_to_world(base.origin)
    return HeldArm(motion.name, spec, qpos, origin, _quaternion(turned), hand, prefix, workspace)


def _quaternion(rotation: FloatArray) -> FloatArray:
    """Return a rotation as (w, x, y, z)."""
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    return quaternion
