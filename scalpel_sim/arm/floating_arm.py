"""Instruments that no arm carries: each is in every frame where its hand has it."""

from collections.abc import Sequence

import mujoco
import numpy as np

from bridge import DeviceLimits
from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.grasper import (
    FORWARD,
    GRASPER,
    PADS_HEEL,
    PADS_TIP,
    HeldArm,
    grasper_spec,
)
from scalpel_sim.arm.hand import Hand, Impedance, add_hand
from scalpel_sim.arm.scalpel import HEEL, TIP, add_scalpel
from scalpel_sim.arm.standing import Standing
from tissue import BladeSegment, BladeShape, FloatArray

_FLOATING = "floating"
"""Name of the body that carries an instrument."""

_AT_ORIGIN = np.array([0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0])
"""Place and rotation of a body in the world before its hand has it anywhere."""


class FloatingArm(DrivenArm):
    """A scalpel, and graspers, that no arm carries. World frame.

    A frame has no dynamics. In its first half each instrument is put where its hand is, and its
    jaws as far open as they are to be. Forces of the tissue move nothing: they are felt alone. So a
    frame may be as long as a control step.

    Args:
        poses: Poses at first: of the edge of the scalpel, and of the pads of each grasper.
        blade: Cross-section of the blade.
        frame_seconds: Length of a frame [s].
        others: What else there is: graspers of `floating_grasper`, a table, fixtures.
    """

    def __init__(
        self,
        poses: Sequence[BladeSegment],
        blade: BladeShape,
        frame_seconds: float,
        others: Sequence[Standing] = (),
    ) -> None:
        spec = mujoco.MjSpec()
        spec.option.timestep = frame_seconds
        body = _floating_body(spec)
        length = float(np.linalg.norm(poses[0].tip - poses[0].heel))
        prefix = add_scalpel(spec, body, blade, length=length)
        super().__init__(
            spec,
            _FLOATING,
            DeviceLimits(),
            heel=prefix + HEEL,
            tip=prefix + TIP,
            others=others,
        )
        hands = [self.hand, *(each.hand for each in self.graspers)]
        self._carried = [_Carried(self.model, self.data, each) for each in hands]
        self.reset(_AT_ORIGIN)
        for each in self._carried:
            each.measure()
        for hand, at in zip(hands, poses, strict=True):
            hand.hold(at)
        self._put()

    def reset(self, qpos: Sequence[float] | FloatArray) -> None:
        """Start again at time 0, at rest; other instruments are where they start.

        Args:
            qpos: Place [m] and rotation (w, x, y, z) of the body with the scalpel, shape (7,).
        """
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[:] = np.concatenate([qpos, *(other.qpos for other in self.others)])
        mujoco.mj_kinematics(self.model, self.data)
        self.hand.hold(self.blade.segment())
        for grasper in self.graspers:
            grasper.hold()

    def step1(self) -> None:
        """Put the instruments where their hands are."""
        self._put()

    def step2(self) -> None:
        """End the frame."""
        self.data.time += self.model.opt.timestep

    def check(self) -> None:
        """Do nothing: a hand refuses a pose that is not finite, and nothing else moves."""

    def check_if_set(self) -> None:
        """Do nothing: see `check`."""

    def _put(self) -> None:
        for each in self._carried:
            each.put()
        for grasper in self.graspers:
            grasper.put_to(grasper.wanted_opening)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_comPos(self.model, self.data)  # the light and the cameras of bodies follow


class _Carried:
    """The body of an instrument, which is put where the hand has its edge.

    Args:
        model: The model.
        data: Its data.
        hand: The hand of the instrument.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData, hand: Hand) -> None:
        body = int(model.site_bodyid[hand.edge])
        while model.body_parentid[body] != 0:
            body = int(model.body_parentid[body])
        address = int(model.jnt_qposadr[model.body_jntadr[body]])
        self._place, self._turn = data.qpos[address : address + 3], data.qpos[address + 3 :][:4]
        self._command = hand.command
        self._at, self._axes = data.site_xpos[hand.edge], data.site_xmat[hand.edge]
        self._body_at, self._body_turn = data.xpos[body], data.xquat[body]
        self._offset, self._offset_turn = np.zeros(3), np.zeros(4)

    def measure(self) -> None:
        """Measure where the body is as its edge sees it."""
        edge, back = np.empty(4), np.empty(4)
        mujoco.mju_mat2Quat(edge, self._axes)
        mujoco.mju_negQuat(back, edge)
        mujoco.mju_rotVecQuat(self._offset, self._body_at - self._at, back)
        mujoco.mju_mulQuat(self._offset_turn, back, self._body_turn)

    def put(self) -> None:
        """Put the body where the hand has the edge."""
        turn = self._command.quaternion
        mujoco.mju_rotVecQuat(self._place, self._offset, turn)
        self._place += self._command.position
        mujoco.mju_mulQuat(self._turn, turn, self._offset_turn)


def floating_grasper(name: str, opening: float, workspace: FloatArray | None) -> HeldArm:
    """Return a grasper that no arm carries.

    Args:
        name: Its name.
        opening: Distance between its pads at first [m].
        workspace: See `HeldArm.workspace`.
    """
    spec = mujoco.MjSpec()
    body = _floating_body(spec)
    spec.attach(grasper_spec(spec), prefix=GRASPER, frame=body.add_frame())
    hand = add_hand(spec, Impedance(), GRASPER + PADS_HEEL, GRASPER + PADS_TIP, FORWARD)
    qpos = np.concatenate([_AT_ORIGIN, 2 * [0.5 * opening]])
    return HeldArm(name, spec, qpos, np.zeros(3), _AT_ORIGIN[3:], hand, workspace=workspace)


def _floating_body(spec: mujoco.MjSpec) -> mujoco.MjsBody:
    """Add a body that may be anywhere to a model."""
    body = spec.worldbody.add_body(name=_FLOATING)
    body.add_freejoint()
    return body
