"""A spring and a damper between the arm's blade and its proxy, the blade that cuts.

The virtual coupling of Colgate, Stanley and Brown (1995) in six degrees of freedom, with a proxy
without mass: the wrenches of tissue and coupling on it are in balance.
"""

import logging
import math
from dataclasses import dataclass

import numpy as np

from bridge.poses import half_length, motion, moved
from tissue import BladeSegment, FloatArray

_log = logging.getLogger(__name__)

DELAY_FRAMES = 1
"""Frames by which the wrench is later than the pose of the arm, assumed for the default damping:
the coupling uses the answer that the tissue gave a frame ago."""

DAMPING_MARGIN = 2.0
"""Default damping as a multiple of the least stable one. At 1 the coupling is marginally stable; at
2 oscillations decay within some periods, and a hand feels little of the damper."""


def least_damping(stiffness: float, dt: float, delay: float = DELAY_FRAMES) -> float:
    """Return the damping [N s/m] above which a sampled spring generates no energy: (d + 1/2) K T.

    Colgate and Schenkel (1997) for d = 0. The force of a spring that answers d frames late is, on
    average, (d + 1/2) T old, which acts as a negative damper.

    Args:
        stiffness: Stiffness K [N/m]; or [N m/rad], for a damping in [N m s/rad].
        dt: Sampling period T [s].
        delay: Whole periods d by which the answer is late.
    """
    return (delay + 0.5) * stiffness * dt


@dataclass(frozen=True)
class VirtualCoupling:
    """Stiffness and damping between the arm's blade and the proxy that cuts.

    The arm never feels anything stiffer than this, whatever the tissue; in exchange its blade and
    the proxy are apart by force / stiffness. The coupling acts at the middle of the edge.

    Raises:
        ValueError: a quantity is not finite, or not positive.
    """

    stiffness: float = 700.0
    """Stiffness [N/m]. The default is the limit of a Touch in CHAI3D, and below that of a Premium
    1.5, 800 N/m: such a device renders it without vibrating."""
    damping: float | None = None
    """Damping [N s/m]; None for `DAMPING_MARGIN` times the least stable one."""
    rotational_stiffness: float | None = None
    """Rotational stiffness [N m/rad]; None for that of half the spring at each end of the edge."""
    rotational_damping: float | None = None
    """Rotational damping [N m s/rad]; None for `DAMPING_MARGIN` times the least stable one."""

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping", "rotational_stiffness", "rotational_damping"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"the coupling's {name} is {value}; it must be positive")

    def matrices(self, lever: float, dt: float) -> tuple[FloatArray, FloatArray]:
        """Return stiffness and damping about the middle of the edge, each shape (6, 6)."""
        rotational = self.rotational_stiffness or self.stiffness * lever * lever
        damping = self.damping or DAMPING_MARGIN * least_damping(self.stiffness, dt)
        rotational_damping = self.rotational_damping or (
            DAMPING_MARGIN * least_damping(rotational, dt)
        )
        return (
            np.diag([self.stiffness] * 3 + [rotational] * 3),
            np.diag([damping] * 3 + [rotational_damping] * 3),
        )


class Proxy:
    """The blade that touches the tissue, driven by the arm's blade through a virtual coupling.

    In each frame it moves to where the wrenches of the coupling and of the tissue, by its local
    model, are in balance. So it stays where the tissue holds it, and the arm feels the balance.

    Args:
        coupling: Stiffness and damping of the coupling.
        dt: Length of the frames [s].
        pose: Pose of the arm's blade, and of the proxy, at the start.
    """

    def __init__(self, coupling: VirtualCoupling, dt: float, pose: BladeSegment) -> None:
        self.pose = pose
        """Pose of the proxy now."""
        lever = half_length(pose)
        self._stiffness, self._damping = coupling.matrices(lever, dt)
        self._offset = np.zeros(6)
        _warn_if_unstable(self._stiffness, self._damping, dt)

    def follow(
        self, arm: BladeSegment, wrench: FloatArray, stiffness: FloatArray, dt: float
    ) -> FloatArray:
        """Follow the arm's blade, and return the tissue's wrench in the balance, shape (6,).

        Args:
            arm: Pose of the arm's blade now.
            wrench: Tissue's wrench on a proxy that does not move [N], [N m] about the tip, (6,).
            stiffness: Decrease of that wrench per motion of the proxy, shape (6, 6).
            dt: Length of the frame [s].
        """
        to_middle = _to_middle(arm)
        spring = to_middle.T @ self._stiffness @ to_middle
        damper = to_middle.T @ self._damping @ to_middle / dt
        offset = motion(self.pose, arm)
        pull = spring @ offset + damper @ (offset - self._offset)
        step = np.asarray(np.linalg.solve(spring + damper + stiffness, wrench + pull))
        self.pose = moved(self.pose, step)
        self._offset = offset - step
        return wrench - stiffness @ step


def _to_middle(pose: BladeSegment) -> FloatArray:
    """Return the matrix from a motion of the tip to one of the middle of the edge, (6, 6)."""
    x, y, z = (0.5 * (pose.heel - pose.tip)).tolist()
    matrix = np.eye(6)
    matrix[:3, 3:] = ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))
    return matrix


def _warn_if_unstable(stiffness: FloatArray, damping: FloatArray, dt: float) -> None:
    """Log a warning if the coupling has less damping than a sampled spring requires."""
    for axis, newton, what in ((0, "N", ""), (3, "N m", "rotational ")):
        spring, damper = stiffness[axis, axis], damping[axis, axis]
        least = least_damping(spring, dt)
        if damper < least:
            _log.warning(
                "a coupling of %.4g %s at %g ms needs a %sdamping of more than "
                "(%d + 1/2) K T = %.3g, and has %.3g: it may vibrate. Raise the damping, or lower "
                "the stiffness to %.3g",
                spring,
                f"{newton}/m" if axis == 0 else f"{newton}/rad",
                1e3 * dt,
                what,
                DELAY_FRAMES,
                least,
                damper,
                damper / ((DELAY_FRAMES + 0.5) * dt),
            )
