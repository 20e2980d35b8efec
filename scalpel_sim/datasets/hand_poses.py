"""Poses of the hands that lead the instruments, and the actions that lead from one to the next."""

from collections.abc import Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.hand import Hand
from scalpel_sim.learning.policy_hand import JAWS, MOTION_NAMES
from scalpel_sim.scene.act_table import ActTable
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.simulation import Simulation
from tissue import FloatArray

_SAME_OPENING = 1e-9
"""Change of the distance between pads that is rounding [m]."""


class HandPose(NamedTuple):
    """Pose of a hand, tissue frame."""

    place: FloatArray
    """Where it wants the middle of the edge, or of the pads [m], shape (3,)."""
    rotation: FloatArray
    """Its rotation (w, x, y, z)."""
    opening: float | None = None
    """Distance between the pads that it wants [m]; None of a blade."""

    @property
    def numbers(self) -> list[float]:
        """All of it in a row."""
        jaws = [] if self.opening is None else [self.opening]
        return [*self.place.tolist(), *self.rotation.tolist(), *jaws]


def poses_of_hands(simulation: Simulation) -> dict[str, HandPose]:
    """Return the poses to which the hands lead the blade and the graspers now, by name."""
    found = {BLADE_NAME: HandPose(*_pose_of(simulation, simulation.arm.hand))}
    for each in simulation.graspers:
        grasper = each.grasper
        found[each.name] = HandPose(*_pose_of(simulation, grasper.hand), grasper.wanted_opening)
    return found


def _pose_of(simulation: Simulation, hand: Hand) -> tuple[FloatArray, FloatArray]:
    """Return place [m] and rotation of a hand, tissue frame."""
    command, frame = hand.command, simulation.frame
    of_tissue, rotation = np.empty(4), np.empty(4)
    mujoco.mju_mat2Quat(of_tissue, np.ascontiguousarray(frame.rotation.T).ravel())
    mujoco.mju_mulQuat(rotation, of_tissue, command.quaternion)
    return frame.points_to_tissue(command.position), rotation


class HandActions:
    """The actions of a policy that would lead hands as they were led.

    Args:
        act: What an action means, and its limits.
        hands: Names of the instruments that are led, in order.
        step: Length of a control step [s].
        start: Poses of the hands at first, by name.
    """

    def __init__(
        self, act: ActTable, hands: Sequence[str], step: float, start: dict[str, HandPose]
    ) -> None:
        self._act, self._hands, self._step = act, tuple(hands), step
        self._last = start
        self._jaws = dict.fromkeys(hands, 0.0)

    def until(self, now: dict[str, HandPose]) -> np.ndarray:
        """Return the action from the last poses to the present ones, single precision.

        A number beyond plus or minus 1 is faster than the limits.
        """
        parts = []
        for name in self._hands:
            before, after = self._last[name], now[name]
            parts += self._motion(before, after).tolist()
            if before.opening is not None and after.opening is not None:
                parts.append(self._jaw(name, after.opening - before.opening))
        self._last = now
        return np.array(parts, np.float32)

    def _motion(self, before: HandPose, after: HandPose) -> FloatArray:
        """Return the six numbers of a motion."""
        act, way, turn, turned = self._act, np.empty(3), np.empty(3), np.empty(3)
        mujoco.mju_subQuat(turn, after.rotation, before.rotation)
        by = after.place - before.place
        if act.frame == "tool":
            back = np.empty(4)
            mujoco.mju_negQuat(back, before.rotation)
            mujoco.mju_rotVecQuat(way, by, back)
            turned = turn
        else:
            way = by
            mujoco.mju_rotVecQuat(turned, turn, before.rotation)
        return np.concatenate([way / (act.speed * self._step), turned / (act.turn * self._step)])

    def _jaw(self, name: str, change: float) -> float:
        """Return 1 from where jaws begin to open, and -1 from where they begin to close."""
        if abs(change) > _SAME_OPENING:
            self._jaws[name] = float(np.sign(change))
        return self._jaws[name]


def action_names(hands: Sequence[str]) -> tuple[str, ...]:
    """Return the name of each number of an action.

    Args:
        hands: Names of the instruments that are led, in order.
    """
    return tuple(
        f"{hand}_{name}"
        for hand in hands
        for name in (MOTION_NAMES if hand == BLADE_NAME else (*MOTION_NAMES, JAWS))
    )
