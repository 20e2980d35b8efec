"""`Expert`: does the strokes and grasps of a scene by the actions of a policy."""

import mujoco
import numpy as np

from bridge import InProcessLink
from scalpel_sim.arm.grasper import HALF_PAD
from scalpel_sim.arm.hand import HandCommand
from scalpel_sim.errors import UsageError
from scalpel_sim.hands.driven_instruments import LiveInstrument
from scalpel_sim.instruments.guarded_follower import GuardedFollower, StrokeProgress
from scalpel_sim.instruments.instrument import Controller
from scalpel_sim.instruments.stroke_follower import StrokeFollower
from scalpel_sim.learning.episode import Episode
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.strokes.grasp_motion import GraspMotion
from scalpel_sim.strokes.scene_stroke import stroke_through
from tissue import FloatArray, TetrahedralMesh


class _Pointer:
    """A hand that holds nothing: followers of strokes show with it where to go."""

    def __init__(self) -> None:
        turn = np.array([1.0, 0.0, 0.0, 0.0])
        self.command = HandCommand(np.zeros(3), turn, np.zeros(6), np.zeros(2))


class _Script:
    """A script of an instrument, with a clock of its own that waits for the instrument.

    Args:
        controller: Moves the pointer.
        pointer: The pointer.
        motion: Opens and closes the jaws; None: there are none.
    """

    def __init__(
        self, controller: Controller, pointer: _Pointer, motion: GraspMotion | None = None
    ) -> None:
        self._controller, self._pointer, self._motion = controller, pointer, motion
        self.at = 0.0
        """Its clock [s]."""

    def wanted(self) -> tuple[FloatArray, FloatArray]:
        """Return where the middle of the edge is to be [m], world frame, and its rotation."""
        self._controller.lead(self.at)
        return self._pointer.command.position, self._pointer.command.quaternion

    def closes(self) -> float:
        """Return the number of the jaws in an action: 1 opens them, -1 closes them, 0 neither."""
        assert self._motion is not None
        now, (closed, opened) = self._motion.opening(self.at), self._motion.pads
        if closed == opened:
            return 0.0
        return 1.0 if now > 0.5 * (closed + opened) else -1.0


class Expert:
    """Does by actions what the strokes and the motions of graspers of the scene do.

    It knows the whole state: it follows the line of a stroke as it lies. Where an action is not
    enough to get to the next pose of a script, the clock of the script waits.

    Args:
        episode: After `reset`; make a new one for each episode.

    Raises:
        UsageError: it is no episode.
    """

    def __init__(self, episode: Episode) -> None:
        if not isinstance(episode, Episode):
            raise UsageError(
                f"an expert acts in an Episode, not in {type(episode).__name__}: an environment "
                "has it as env.unwrapped.episode"
            )
        self._episode, simulation = episode, episode.simulation
        scene, frame, link = episode.scene, simulation.frame, simulation.link
        assert isinstance(link, InProcessLink)
        body = link.snapshot()
        mesh = TetrahedralMesh(body.positions, body.tetrahedra)
        stroke = stroke_through(
            mesh, episode.strokes, link.describe().material, scene.world.stop, body.rest_positions
        )
        self._scripts: dict[str, _Script] = {}
        self._progress: StrokeProgress | None = None
        if BLADE_NAME in episode.hand.led:
            pointer = _Pointer()
            controller: Controller = StrokeFollower(pointer, stroke, frame)
            self._progress = StrokeProgress(stroke) if stroke.guards else None
            if self._progress is not None:
                there = (link, simulation.bridge)
                controller = GuardedFollower(pointer, stroke, frame, *there, self._progress)
            self._scripts[BLADE_NAME] = _Script(controller, pointer)
        for motion in episode.motions:
            if motion.name in episode.hand.led:
                pointer = _Pointer()
                follower = StrokeFollower(pointer, motion.stroke(HALF_PAD, HALF_PAD), frame)
                self._scripts[motion.name] = _Script(follower, pointer, motion)

    def action(self) -> FloatArray:
        """Return the next action."""
        episode, parts = self._episode, []
        step = episode.act_table.step
        if self._progress is not None:
            self._progress.force = float(np.linalg.norm(episode.simulation.blade.wrench.force))
        for name, instrument in episode.hand.led.items():
            script = self._scripts[name]
            script.at += step
            part = self._towards(instrument, *script.wanted())
            longest = float(np.abs(part).max())
            if longest > 1.0:
                part /= longest
                script.at -= step
            parts += part.tolist()
            if instrument is not episode.hand.blade:
                parts.append(script.closes())
        return np.array(parts)

    def _towards(
        self, instrument: LiveInstrument, place: FloatArray, rotation: FloatArray
    ) -> FloatArray:
        """Return the six numbers of an action that leads to a pose, however large they are."""
        act, frame = self._episode.act_table, self._episode.simulation.frame
        pose = instrument.pose
        by = frame.points_to_tissue(place) - pose.wanted
        turned, turn = np.empty(4), np.empty(3)
        mujoco.mju_mulQuat(turned, _inverse(_quaternion(frame.rotation)), rotation)
        mujoco.mju_subQuat(turn, turned, pose.wanted_rotation)
        if act.frame == "tool":
            by = instrument.axes @ by
        else:
            mujoco.mju_rotVecQuat(turn, turn.copy(), pose.wanted_rotation)
        return np.concatenate([by / (act.speed * act.step), turn / (act.turn * act.step)])


def _quaternion(rotation: FloatArray) -> FloatArray:
    quaternion = np.empty(4)
    mujoco.mju_mat2Quat(quaternion, rotation.ravel())
    return quaternion


def _inverse(rotation: FloatArray) -> FloatArray:
    found = np.empty(4)
    mujoco.mju_negQuat(found, rotation)
    return found
