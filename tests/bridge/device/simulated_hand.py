"""A hand with a device in it, and tissue that answers late, in exact time without a clock."""

import math

import numpy as np

from bridge import BladeReport, CartesianPose, DeviceLimits
from bridge.coupling.coupling import RAMP
from bridge.device.felt_force import FeltForce

PERIOD = 1e-3
"""Period of the device [s]."""

LEVER = 0.04
"""Half the length of the edge [m]."""

FRAME = 1e-3
"""Simulated time of a frame [s]."""

UNTURNED = np.array([1.0, 0.0, 0.0, 0.0])

FOLLOWING = 0.004
"""Time constant with which the blade follows the stylus [s], as that of the hand of a run."""


def at(y: float) -> CartesianPose:
    return CartesianPose(np.array([0.0, y, 0.0]), UNTURNED)


def report(now, force, stiffness=0.0, y=0.0, *, work=0.0, engaged=True) -> BladeReport:
    """Return the report of a blade at y that feels a force along y [N]."""
    wrench, matrix = np.zeros(6), np.zeros((6, 6))
    wrench[1], matrix[1, 1] = force, stiffness
    origin = at(0.0)
    return BladeReport(
        now, now, 1.0, engaged, False, 0, work, at(y), wrench, matrix, at(y), origin, origin
    )


def along(y: float) -> np.ndarray:
    """Return a motion along y."""
    return np.array([0.0, y, 0.0, 0.0, 0.0, 0.0])


class Wall:
    """Elastic tissue from y = 0 on, whose contacts alone are stiffer than what is behind them."""

    def __init__(self, stiffness: float, contacts: float) -> None:
        self.stiffness, self.contacts = stiffness, contacts

    def force(self, y: float) -> float:
        return -self.stiffness * max(y, 0.0)

    def contact_stiffness(self, y: float) -> float:
        return self.contacts if y > 0.0 else 0.0


class Cut:
    """Tissue that is pressed until it is cut with a constant force; a cut does not come back."""

    def __init__(self, stiffness: float, contacts: float, force: float) -> None:
        self.stiffness, self.contacts, self.most = stiffness, contacts, force
        self._front = 0.0

    def force(self, y: float) -> float:
        pressed = y - self._front
        self._front = max(self._front, y - self.most / self.stiffness)
        return -min(self.stiffness * max(pressed, 0.0), self.most)

    def contact_stiffness(self, y: float) -> float:
        return self.contacts if y > self._front else 0.0


class LastForce:
    """The force of the last frame as it is, which the hand feels until the next one."""

    def take(self, frame: BladeReport) -> None:
        self._wrench = frame.wrench

    def driven(self, ahead, step, now, period, *, holds) -> np.ndarray:
        return self._wrench


class HeldDevice:
    """A device of 0.1 kg in a hand, at tissue of a run that is slower than real time.

    The blade follows the stylus with a lag, frame by frame; each frame is reported as it ends.

    Args:
        tissue: What it meets.
        factor: Simulated time over wall time.
        felt: What answers it; None: `FeltForce`.
        mass: Of device and hand [kg].
        grip: Stiffness [N/m] and damping [N s/m] with which the person holds it.
    """

    def __init__(self, tissue, factor, felt=None, mass=0.1, grip=(200.0, 2.0)) -> None:
        self.tissue, self.mass, self.grip = tissue, mass, grip
        self.felt = felt or FeltForce(DeviceLimits(), LEVER)
        self.per_frame = max(1, round(FRAME / factor / PERIOD))
        self.y = self.v = self.blade = self.force = 0.0
        self.n = 0
        self.got = self.most_got = 0.0
        self.forces: list[float] = [0.0]
        self.places: list[float] = []
        self.felt.take(report(0.0, 0.0))
        self.follow(lambda t: 0.0, RAMP)  # in the air, where the wrench of a new device rises

    def follow(self, target, seconds: float) -> "HeldDevice":
        """Hold it at `target(t)` for so long."""
        start = self.n
        for _ in range(round(seconds / PERIOD)):
            now = (self.n - start) * PERIOD
            k, b = self.grip
            # Semi-implicit, so that the person's spring itself generates no energy.
            pull = k * (target(now) - self.y) - b * self.v
            self.v += PERIOD * (pull + self.force) / self.mass
            step = PERIOD * self.v
            self.y += step
            self.n += 1
            self._advance()
            before = self.force
            self.force = float(
                self.felt.driven(
                    along(self.y - self.blade), along(step), self.n * PERIOD, PERIOD, holds=True
                )[1]
            )
            self.got += 0.5 * (before + self.force) * step
            self.most_got = max(self.most_got, self.got)
            self.forces.append(self.force)
            self.places.append(self.y)
        return self

    def _advance(self) -> None:
        if self.n % self.per_frame == 0:
            seconds = self.per_frame * PERIOD
            self.blade += (self.y - self.blade) * (1.0 - math.exp(-seconds / FOLLOWING))
            force = self.tissue.force(self.blade)
            stiffness = self.tissue.contact_stiffness(self.blade)
            now = self.n * PERIOD
            self.felt.take(report(now, force, stiffness, self.blade))
