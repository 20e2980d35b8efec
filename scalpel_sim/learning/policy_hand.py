"""A hand that a policy leads: what an action says is done evenly over a control step."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from scalpel_sim.hands.driven_instruments import LiveInstrument
from scalpel_sim.hands.limited_pose import LimitedPose
from scalpel_sim.hands.teleoperation import Teleoperation
from scalpel_sim.instruments.driven_grasper import MotionFollower
from scalpel_sim.scene.act_table import ActTable
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.grasp_motion import GraspMotion
from tissue import FloatArray, Wrench

MOTION_NAMES = ("move_x", "move_y", "move_z", "turn_x", "turn_y", "turn_z")
"""Names of the numbers of an action, after the name of the hand."""

JAWS = "jaws"
"""Name of the number of a grasper that opens its jaws, above 0, or closes them, below."""


class EvenPose(LimitedPose):
    """A pose that arrives where it is wanted after a number of frames, at an even speed."""

    most_speed = most_turn_rate = farthest_ahead = math.inf  # an action has limits of its own
    most_ahead_turn = math.pi
    n_frames = 1
    """Frames that are left until it is to arrive."""

    def share(self) -> float:
        """See `LimitedPose.share`."""
        share, self.n_frames = 1.0 / self.n_frames, max(self.n_frames - 1, 1)
        return share


class PolicyHand(Teleoperation):
    """A hand that is told at each control step how far each instrument moves and turns.

    Instruments that it does not lead follow the motions of the scene.

    Args:
        simulation: At its start, prepared to be led.
        act: Limits of an action, and who is led.
        hands: Names of the instruments that it leads, in order: that of the scene.
        motions: Motions of all graspers, for those that it does not lead.
    """

    def __init__(
        self,
        simulation: Simulation,
        act: ActTable,
        hands: Sequence[str],
        motions: Sequence[GraspMotion],
    ) -> None:
        super().__init__(simulation)
        self._act, self._scripted = act, dict[str, GraspMotion]()
        self._n_frames = max(round(act.step / simulation.dt), 1)
        self._instruments = {
            name: instrument
            for name, instrument in zip(
                (BLADE_NAME, *(each.name for each in simulation.graspers)),
                self.instruments,
                strict=True,
            )
            if name in hands
        }
        for instrument in self.instruments:
            limited = instrument.pose
            instrument.pose = EvenPose(
                limited.middle, limited.rotation, limited.workspace, simulation.dt
            )
        for motion in motions:
            if motion.name not in hands:
                self._scripted[motion.name] = motion

    @property
    def action_names(self) -> tuple[str, ...]:
        """Name of each number of an action."""
        return tuple(name for names in self.names_by_hand.values() for name in names)

    @property
    def names_by_hand(self) -> dict[str, tuple[str, ...]]:
        """Names of the numbers of an action that lead each instrument, in order."""
        found = {}
        for name, instrument in self._instruments.items():
            of_motion = MOTION_NAMES if instrument is self.blade else (*MOTION_NAMES, JAWS)
            found[name] = tuple(f"{name}_{each}" for each in of_motion)
        return found

    @property
    def led(self) -> dict[str, LiveInstrument]:
        """Instruments that it leads, by name."""
        return dict(self._instruments)

    @property
    def n_frames(self) -> int:
        """Number of frames of a control step."""
        return self._n_frames

    def state(self) -> list[dict[str, list[float]]]:
        """Return where it leads each instrument: all that the next control step depends on."""
        return [each.state() for each in self.instruments]

    def return_to(self, state: list[dict[str, list[float]]]) -> None:
        """Return to what `state` returned."""
        for instrument, its in zip(self.instruments, state, strict=True):
            instrument.return_to(its)

    def take_over(self, simulation: Simulation) -> None:
        """See `Teleoperation.take_over`."""
        super().take_over(simulation)
        for grasper in simulation.graspers:
            motion = self._scripted.get(grasper.name)
            if motion is not None:
                grasper.controller = MotionFollower(grasper.grasper, motion, simulation.frame)

    def put(self, starts: Mapping[str, FloatArray], simulation: Simulation) -> None:
        """Put instruments that nothing carries elsewhere at once; no time passes.

        Args:
            starts: By how much, by name [m], tissue frame, shape (3,) each.
            simulation: The simulation that it was made for.
        """
        for name, by in starts.items():
            self._instruments[name].put(by)
            self._instruments[name].lead(simulation.time)
        simulation.arm.step1()
        simulation.blade.follow()

    def go(self, starts: Mapping[str, FloatArray]) -> int:
        """Begin to lead instruments elsewhere; return the control steps that it takes.

        Args:
            starts: By how much, by name [m], tissue frame, shape (3,) each.
        """
        n = 1
        for name, by in starts.items():
            pose, way = self._instruments[name].pose, float(np.linalg.norm(by))
            assert isinstance(pose, EvenPose)
            of_this = 1 + math.ceil(way / (self._act.speed * self._act.step))
            pose.n_frames = of_this * self._n_frames
            pose.move(by)
            n = max(n, of_this)
        return n

    def obey(self, action: FloatArray, wrenches: Mapping[str, Wrench]) -> None:
        """Do an action over the next control step.

        Args:
            action: Numbers in [-1, 1], in the order of `action_names`; others are clipped.
            wrenches: Wrench on each instrument that is led, world frame; it is used where the
                force of an action is limited.
        """
        action = np.clip(np.asarray(action, np.float64), -1.0, 1.0)
        act, at = self._act, 0
        for name, instrument in self._instruments.items():
            by, turn = action[at : at + 3], action[at + 3 : at + 6]
            at += 6
            by, turn = by * (act.speed * act.step), turn * (act.turn * act.step)
            if act.frame == "tool":
                axes = instrument.axes
                by, turn = by @ axes, turn @ axes
            if act.force is not None:
                by = self._yielding(by, wrenches[name], act.force)
            pose = instrument.pose
            assert isinstance(pose, EvenPose)
            pose.n_frames = self._n_frames
            pose.move(by)
            pose.turn(turn)
            if instrument is not self.blade:
                if action[at] != 0.0:
                    instrument.close_jaws(bool(action[at] < 0.0))
                at += 1

    def _yielding(self, by: FloatArray, wrench: Wrench, limit: float) -> FloatArray:
        """Return a motion without its part against a force above the limit [N]."""
        force = self._frame.vectors_to_tissue(wrench.force)
        size = math.hypot(*force.tolist())
        if size <= limit:
            return by
        against = min(float(by @ force) / size, 0.0)
        return np.asarray(by - against * force / size)

    def _obey(self) -> bool:
        """Return whether the run is to end: a policy ends none."""
        return False
