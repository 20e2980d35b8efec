"""A spring and a damper between the arm's blade and a proxy of it, which is the one that cuts.

The virtual coupling of Colgate, Stanley and Brown (1995) in six degrees of freedom, with a proxy
without mass: what the tissue does to it and what the coupling does to it are in balance.
"""

import logging
import math
from dataclasses import dataclass

import numpy as np

from bridge.poses import half_length, motion, moved
from tissue import BladeSegment, FloatArray

_log = logging.getLogger(__name__)

DELAY = 1
"""Frames between the arm's pose and the answer that it feels, for which a damping is chosen that is
not given: the coupling answers with what the tissue said a frame ago."""

RESERVE = 2.0
"""How many times the least damping a coupling has whose damping is not given. At 1 it is just
stable; at 2 what swings dies away within some periods, and a hand feels little of it."""


def least_damping(stiffness: float, dt: float, delay: float = DELAY) -> float:
    """Return the damping [N s/m] above which a sampled spring makes no energy: (d + 1/2) K T.

    Colgate and Schenkel (1997) for d = 0. A spring that answers d frames late pushes by what the
    blade was pressed in (d + 1/2) T ago, on the mean, and that is a damper of less than nothing.

    Args:
        stiffness: [N/m]; or [N m/rad], for a damping in [N m s/rad].
        dt: Sampling period T [s].
        delay: Whole periods that the answer comes late.
    """
    return (delay + 0.5) * stiffness * dt


@dataclass(frozen=True)
class VirtualCoupling:
    """How firmly the arm's blade holds the proxy that cuts.

    The arm never feels anything stiffer than this, whatever the tissue; in exchange its blade and
    the one that cuts are apart by force / stiffness. The centre is the middle of the edge.

    Raises:
        ValueError: a quantity is not finite, or not positive.
    """

    stiffness: float = 700.0
    """[N/m]. CHAI3D's limit for a Touch, and within that of a Premium 1.5, 800 N/m: what such a
    device renders without vibrating."""
    damping: float | None = None
    """[N s/m]; None for `RESERVE` times the least that is stable."""
    turning_stiffness: float | None = None
    """[N m/rad]; None for what half of the spring at each end of the edge makes of it."""
    turning_damping: float | None = None
    """[N m s/rad]; None in the same way."""

    def __post_init__(self) -> None:
        for name in ("stiffness", "damping", "turning_stiffness", "turning_damping"):
            value = getattr(self, name)
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"the coupling's {name} is {value}; it must be positive")

    def matrices(self, lever: float, dt: float) -> tuple[FloatArray, FloatArray]:
        """Return stiffness and damping about the middle of the edge, each shape (6, 6)."""
        turning = self.turning_stiffness or self.stiffness * lever * lever
        damping = self.damping or RESERVE * least_damping(self.stiffness, dt)
        turning_damping = self.turning_damping or RESERVE * least_damping(turning, dt)
        return (
            np.diag([self.stiffness] * 3 + [turning] * 3),
            np.diag([damping] * 3 + [turning_damping] * 3),
        )


class Proxy:
    """The blade that the tissue meets, led by the arm's through a virtual coupling.

    In each frame it goes to where the coupling's wrench and the tissue's, by its local model, are
    in balance. So it stays where the tissue holds it, and the arm feels the balance.

    Args:
        coupling: Between the two.
        dt: Length of the frames [s].
        pose: Of the arm's blade at the start; the proxy's too.
    """

    def __init__(self, coupling: VirtualCoupling, dt: float, pose: BladeSegment) -> None:
        self.pose = pose
        """Where it is."""
        lever = half_length(pose)
        self._stiffness, self._damping = coupling.matrices(lever, dt)
        self._offset = np.zeros(6)
        _warn_if_unstable(self._stiffness, self._damping, dt)

    def follow(
        self, arm: BladeSegment, wrench: FloatArray, stiffness: FloatArray, dt: float
    ) -> FloatArray:
        """Go after the arm's blade, and return what both feel of the tissue, shape (6,).

        Args:
            arm: The pose of its blade now.
            wrench: What the tissue would do to a proxy that stayed [N], [N m about the tip], (6,).
            stiffness: By how much less where it moves, shape (6, 6).
            dt: Length of the frame [s].
        """
        to_middle = _to_middle(arm)
        spring = to_middle.T @ self._stiffness @ to_middle
        damper = to_middle.T @ self._damping @ to_middle / dt
        offset = motion(self.pose, arm)
        pull = spring @ offset + damper @ (offset - self._offset)
        way = np.asarray(np.linalg.solve(spring + damper + stiffness, wrench + pull))
        self.pose = moved(self.pose, way)
        self._offset = offset - way
        return wrench - stiffness @ way


def _to_middle(pose: BladeSegment) -> FloatArray:
    """Return the matrix that makes a motion of the tip one of the middle of the edge, (6, 6)."""
    x, y, z = (0.5 * (pose.heel - pose.tip)).tolist()
    matrix = np.eye(6)
    matrix[:3, 3:] = ((0.0, z, -y), (-z, 0.0, x), (y, -x, 0.0))
    return matrix


def _warn_if_unstable(stiffness: FloatArray, damping: FloatArray, dt: float) -> None:
    """Say so where a coupling has less damping than a sampled spring asks for."""
    for axis, newton, what in ((0, "N", ""), (3, "N m", "turning ")):
        spring, damper = stiffness[axis, axis], damping[axis, axis]
        least = least_damping(spring, dt)
        if damper < least:
            _log.warning(
                "a coupling of %.4g %s at %g ms takes a %sdamping of more than "
                "(%d + 1/2) K T = %.3g, and has %.3g: it may vibrate. Raise the damping, or lower "
                "the stiffness to %.3g",
                spring,
                f"{newton}/m" if axis == 0 else f"{newton}/rad",
                1e3 * dt,
                what,
                DELAY,
                least,
                damper,
                damper / ((DELAY + 0.5) * dt),
            )
