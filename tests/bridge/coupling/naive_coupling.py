"""The arithmetic of the coupling again, slow and obvious, in NumPy."""

import numpy as np

from bridge.arithmetic import ENERGY_TOLERANCE
from bridge.coupling.coupling import (
    DECAY_AFTER,
    MAX_PLAUSIBLE_FORCE,
    MAX_PLAUSIBLE_TORQUE,
    RAMP,
    ZERO_AFTER,
)


class NaiveCoupling:
    """What an arm feels, frame by frame; wrenches have shape (6,)."""

    def __init__(self, limits, dt):
        self.limits, self.dt = limits, dt
        self.felt = np.zeros(6)
        self.energy = self.work_at_start = 0.0
        self.gain = 1.0

    def render(self, wrench, motion, lever, work, silence):
        wanted = self.limited(self.plausible(wrench), silence)
        felt = self.slewed(self.passive(wanted, motion, lever, work))
        self.energy -= 0.5 * np.dot(self.felt + felt, motion)
        self.felt = felt
        return felt

    def plausible(self, wrench):
        force, torque = np.linalg.norm(wrench[:3]), np.linalg.norm(wrench[3:])
        if force <= MAX_PLAUSIBLE_FORCE and torque <= MAX_PLAUSIBLE_TORQUE:
            return wrench
        self.gain = 0.0
        return np.zeros(6)

    def limited(self, wrench, silence):
        fading = np.clip((ZERO_AFTER - silence) / (ZERO_AFTER - DECAY_AFTER), 0.0, 1.0)
        self.gain = min(fading, self.gain + self.dt / RAMP)
        faded = self.gain * wrench
        force, torque = np.linalg.norm(faded[:3]), np.linalg.norm(faded[3:])
        shares = [1.0]
        if force > self.limits.force:
            shares.append(self.limits.force / force)
        if torque > self.limits.torque:
            shares.append(self.limits.torque / torque)
        return min(shares) * faded

    def passive(self, wanted, motion, lever, work):
        if not self.felt.any() and not wanted.any():
            self.energy, self.work_at_start = 0.0, work
        given = min(0.0, work - self.work_at_start)
        spent, power = np.dot(self.felt, motion), np.dot(wanted, motion)
        left = self.energy - 0.5 * spent - given + ENERGY_TOLERANCE
        most = left if left >= 0.0 else max(2.0 * left, -abs(spent))
        if power <= most:
            return wanted
        damper = np.concatenate([motion[:3], lever**2 * motion[3:]])
        damped = wanted - (power - most) / np.dot(damper, motion) * damper
        is_allowed = np.linalg.norm(damped[:3]) <= self.limits.force
        if is_allowed and np.linalg.norm(damped[3:]) <= self.limits.torque:
            return damped
        if most >= 0.0:
            return wanted * most / power
        opposite = self.felt if spent < 0.0 else -self.felt
        share = (power - most) / (power + abs(spent))
        return (1.0 - share) * wanted + share * opposite

    def slewed(self, wrench):
        change = np.linalg.norm(wrench[:3] - self.felt[:3])
        reach = self.limits.slew * self.dt
        if change <= reach:
            return wrench
        return self.felt + reach / change * (wrench - self.felt)


def naive_motion(before, after):
    """Return the translation of the tip and the rotation vector between two poses, shape (6,)."""

    def axes(pose):
        along = (pose.heel - pose.tip) / np.linalg.norm(pose.heel - pose.tip)
        across = pose.forward - (pose.forward @ along) * along
        across /= np.linalg.norm(across)
        return np.stack([along, across, np.cross(along, across)], axis=1)

    turn = axes(after) @ axes(before).T
    spin = 0.5 * np.array(
        [turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]
    )
    sine, cosine = np.linalg.norm(spin), 0.5 * (np.trace(turn) - 1.0)
    scale = np.arctan2(sine, cosine) / sine if sine > 0.0 else 1.0
    return np.concatenate([after.tip - before.tip, scale * spin])
