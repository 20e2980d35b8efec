"""From the graspers of a scene to arms that hold them, and to what leads them."""

from collections.abc import Sequence
from pathlib import Path

import mujoco
import numpy as np

from bridge import Bridge, TissueFrame
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.grasper import HeldArm
from scalpel_sim.arm.placement import AUTO, Placement, covered
from scalpel_sim.instruments.driven_grasper import DrivenGrasper, GripSettings
from scalpel_sim.instruments.second_arm import (
    model_with_grasper,
    place_of_driven_grasper,
    place_of_grasper,
    preset_with_grasper,
)
from scalpel_sim.scene.schema import DEFAULT_ACROSS, DEFAULT_APPROACH, GrasperTable
from scalpel_sim.strokes.grasp_motion import GraspMotion, Waypoint
from scalpel_sim.strokes.recorded_grasp import grasp_from_csv
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
    table = None if first is None else -float(first[0].tissue_origin[2])
    taken = [] if first is None else [covered(*first, boxes, times)]
    found = []
    for grasper, motion, workspace in zip(graspers, motions, workspaces, strict=True):
        if grasper.model is None:
            preset, reached = grasper.preset or AUTO, None
            if workspace is None:
                place, spheres = place_of_grasper(
                    motion, boxes, preset, times, table=table, others=taken
                )
            else:
                place, spheres, reached = place_of_driven_grasper(
                    motion,
                    workspace,
                    boxes,
                    preset,
                    times,
                    table=table,
                    others=taken,
                )
            taken.append(spheres)
            arm = preset_with_grasper(motion, place, frame, force=grasper.force, workspace=reached)
        else:
            assert grasper.at is not None
            base = TissueFrame(_rotation(grasper), np.array(grasper.pos or (0.0, 0.0, 0.0)))
            model = Path(grasper.model)
            arm = model_with_grasper(
                motion,
                model,
                grasper.at,
                base,
                frame,
                force=grasper.force,
                workspace=workspace,
            )
        found.append(arm)
    return found


def _rotation(grasper: GrasperTable) -> FloatArray:
    """Return how the model of an arm is turned in the frame of the tissue, shape (3, 3)."""
    quaternion, axes = np.array(grasper.quat or (1.0, 0.0, 0.0, 0.0)), np.empty(9)
    mujoco.mju_quat2Mat(axes, quaternion / np.linalg.norm(quaternion))
    return axes.reshape(3, 3)


def driven_graspers(
    graspers: Sequence[GrasperTable],
    motions: Sequence[GraspMotion],
    arm: DrivenArm,
    bridge: Bridge,
) -> list[DrivenGrasper]:
    """Return what leads the graspers of a scene.

    Args:
        graspers: What the scene says of them.
        motions: Where they go, tissue frame.
        arm: In whose model they are.
        bridge: To the tissue that they may hold.
    """
    return [
        DrivenGrasper(
            grasper,
            arm.data,
            motion,
            bridge,
            settings=_grip_settings(table),
            workspace=held.workspace,
        )
        for table, motion, grasper, held in zip(
            graspers, motions, arm.graspers, arm.others, strict=True
        )
    ]


def _grip_settings(table: GrasperTable) -> GripSettings | None:
    """Return how a grasper holds what its jaws close on; None: by friction alone."""
    if table.holds == "friction":
        return None
    given = {name: getattr(table, name) for name in GripSettings._fields}
    return GripSettings()._replace(
        **{name: value for name, value in given.items() if value is not None}
    )
