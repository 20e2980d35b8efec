"""Instruments of a scene that no arm carries, at the start."""

from collections.abc import Sequence

from bridge import TissueFrame
from scalpel_sim.arm.floating_arm import FloatingArm, floating_grasper
from scalpel_sim.arm.grasper import HALF_PAD
from scalpel_sim.arm.standing import Standing
from scalpel_sim.instruments.scene_arms import (
    ROOM,
    ROOM_OF_GRASPER,
    ArmSurroundings,
    StandingArms,
    standing_around,
    workspace_in,
)
from scalpel_sim.scene.blade import SCALPEL
from scalpel_sim.scene.scene import Scene
from scalpel_sim.strokes.grasp_motion import GraspMotion
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray


def floating_arms_in(
    scene: Scene,
    stroke: Stroke,
    motions: Sequence[GraspMotion],
    around: ArmSurroundings,
    frame_seconds: float,
) -> StandingArms:
    """Return instruments that no arm carries, and what stands next to them.

    Tissue and world have one frame.

    Args:
        scene: The scene.
        stroke: Where the blade goes; of a hand, where it starts.
        motions: Where the graspers go.
        around: What is in the way.
        frame_seconds: Length of a frame [s].
    """
    frame, bounds = TissueFrame(), around.boxes[0]

    def workspace(start: BladeSegment, room: float) -> FloatArray | None:
        return workspace_in(scene, start, bounds, room) if stroke.is_led else None

    pads = [motion.stroke(HALF_PAD, HALF_PAD).pose(0.0) for motion in motions]
    graspers: list[Standing] = [
        floating_grasper(motion.name, motion.opening(0.0), workspace(start, ROOM_OF_GRASPER))
        for motion, start in zip(motions, pads, strict=True)
    ]
    others = [*graspers, *standing_around(around, frame)]
    start = stroke.pose(0.0)
    arm = FloatingArm([start, *pads], scene.blade or SCALPEL, frame_seconds, others)
    return StandingArms(arm, frame, stroke, others, workspace(start, ROOM))
