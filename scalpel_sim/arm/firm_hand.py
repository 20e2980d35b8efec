"""A hand that leads a heavy arm as fast as the usual one leads a light arm."""

import math
from typing import Final

import mujoco
import numpy as np

from scalpel_sim.arm.arm import DrivenArm
from scalpel_sim.arm.hand import Impedance
from tissue import FloatArray

_USUAL_MASS, _USUAL_MOMENT = 0.07, 0.07 * 0.08**2
"""Mass [kg] and moment of inertia [kg m2] that the usual hand feels; see `Impedance`."""
_SELF_MOTION: Final = 0.1
"""Time within which what joints do without moving the edge ends [s]: a tenth of a stroke."""
_LEAST_MOBILITY: Final = 1e-9
"""Mobility below which an edge does not move [1/kg or 1/(kg m2)]: that is rounding."""


def firm_impedance(arm: DrivenArm, *, lever: float = 0.0) -> Impedance:
    """Return a hand that moves this arm as fast as the usual one moves the arms of the scenes.

    A robot is a hundred times as heavy at its edge: the usual hand would leave it swinging at 5 Hz.
    Stiffness and damping follow its inertia there (Khatib 1987, IEEE J. Robotics and Automation
    3:43), and are critical.

    Args:
        arm: The arm, alone in its model, in a configuration in which it will work.
        lever: From the wrist to the middle of the edge [m], where a heavy arm has a light wrist:
            what moves the arm acts at the edge, and would turn the wrist. So the hand is at least
            as firm against turning as against displacement at that lever.
    """
    model, data = arm.model, arm.data
    position, rotation = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, position, rotation, arm.hand.edge)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    mass, moment = (_felt(jacobian, inertia) for jacobian in (position, rotation))
    usual = Impedance()
    rate = math.sqrt(usual.stiffness / _USUAL_MASS)
    turning = math.sqrt(usual.rotational_stiffness / _USUAL_MOMENT)
    stiffness = max(usual.stiffness, mass * rate**2)
    damping = max(usual.damping, 2.0 * mass * rate)
    return Impedance(
        stiffness,
        damping,
        max(usual.rotational_stiffness, moment * turning**2, stiffness * lever**2),
        max(usual.rotational_damping, 2.0 * moment * turning, damping * lever**2),
    )


def damping_of_self_motion(arm: DrivenArm) -> FloatArray:
    """Return the damping of joints that an arm of more joints than motions needs, by joint.

    The hand holds the edge alone. What joints can do without moving it, as an elbow that goes up,
    would otherwise go on for ever once a stroke has begun it, until links meet. Damped, it ends
    within `_SELF_MOTION`; the edge lags by no more than some 10 um, for hands are as firm as arms
    are heavy.

    Args:
        arm: The arm, alone in its model, in a configuration in which it will work.

    Returns:
        Damping [N m s/rad or N s/m], shape (n_joints,); 0 where the edge says where joints are, and
        of joints that do not carry it.
    """
    model, data = arm.model, arm.data
    position, rotation = np.zeros((3, model.nv)), np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, position, rotation, arm.hand.edge)
    motions = np.vstack([position, rotation])
    carries = np.abs(motions).max(axis=0) > 0.0
    if carries.sum() <= np.linalg.matrix_rank(motions, tol=_LEAST_MOBILITY):
        return np.zeros(model.nv)
    inertia = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, inertia)
    return np.where(carries, np.diag(inertia) / _SELF_MOTION, 0.0)


def _felt(jacobian: FloatArray, inertia: FloatArray) -> float:
    """Return the largest inertia that is felt at the edge [kg or kg m2], where the arm is free.

    It is 0 where no joint moves it at all: slides do not turn it.
    """
    mobility = np.linalg.eigvalsh(jacobian @ np.linalg.solve(inertia, jacobian.T))
    free = mobility[mobility > max(1e-6 * mobility.max(), _LEAST_MOBILITY)]
    return float(1.0 / free.min()) if len(free) else 0.0
