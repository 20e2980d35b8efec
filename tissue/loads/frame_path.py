"""`FramePath`: where a frame is led by itself, over time."""

import math

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray


class FramePath:
    """Displacements of a frame over time: at an even speed from each to the next, then it stays.

    Args:
        times: When it is there, after the start [s], shape (n,), increasing, above 0.
        displacements: How far it is then from where it was at the start [m], shape (n, 3).
        release_at: When what is held there is released, after the start [s].

    Raises:
        ValueError: the shapes do not fit, a number is not finite, or the times do not increase.
    """

    def __init__(
        self,
        times: npt.ArrayLike = (),
        displacements: npt.ArrayLike = (),
        *,
        release_at: float = math.inf,
    ) -> None:
        at = np.array(times, dtype=np.float64)
        ways = np.array(displacements, dtype=np.float64).reshape(-1, 3)
        if at.shape != (len(ways),):
            raise ValueError(f"{at.size} times for {len(ways)} displacements; give one for each")
        if not (np.isfinite(at).all() and np.isfinite(ways).all()):
            raise ValueError("a time or a displacement is not finite")
        if not (np.diff(at, prepend=0.0) > 0.0).all():
            raise ValueError(f"times are {at.tolist()}; they begin above 0 and increase")
        if not release_at >= 0.0:
            raise ValueError(f"release_at is {release_at} s; it must be 0 or more")
        self.release_at = float(release_at)
        self._times = np.concatenate(([0.0], at))
        self._ways = np.concatenate((np.zeros((1, 3)), ways))

    def at(self, seconds: float) -> FloatArray:
        """Return the displacement at a time after the start [m], shape (3,)."""
        return np.array([np.interp(seconds, self._times, way) for way in self._ways.T])
