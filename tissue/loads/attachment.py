"""Attachments of tissue to what moves from outside: a jaw, a hook, the world."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.limits import LARGEST_COORDINATE, LARGEST_STRENGTH
from tissue.core.three_vectors import Wrench
from tissue.forces.attachments import SEVERED
from tissue.geometry.rotations import checked_rotation
from tissue.loads.material_points import MaterialPoints


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


class Attachment:
    """Points of a tissue that springs and dampers tie to a rigid frame, until it is released.

    Args:
        points: The points.
        others: Where the other ends of the springs are now [m], shape (n, 3): where the points are,
            unless each is slack.
        stiffness: Of all springs together [N/m].
        damping: Of all dampers together [N s/m].
        rest_length: Length up to which each point is slack, in any direction [m]; 0: it is held
            where it is.
        breaks_at: Force at which it releases the points [N].
        origin: Origin of the frame [m], shape (3,).

    Raises:
        ValueError: a number is not finite, has the wrong sign, or is beyond `tissue.core.limits`.
    """

    def __init__(
        self,
        points: MaterialPoints,
        others: FloatArray,
        stiffness: float,
        damping: float = 0.0,
        rest_length: float = 0.0,
        breaks_at: float = math.inf,
        origin: Sequence[float] | FloatArray | None = None,
    ) -> None:
        expect_strength("stiffness", stiffness, "N/m")
        if not breaks_at > 0.0:
            raise ValueError(f"breaks_at is {breaks_at} N; it must be positive")
        self.points = points
        self.to: MaterialPoints | None = None
        """Points of the tissue at the other ends, where it ties two bodies; None: a frame."""
        self.number = -1
        """Its number among all attachments of its tissue; -1 where it never held."""
        self.stiffness = float(stiffness)
        self.damping = checked_amount("damping", damping, LARGEST_STRENGTH)
        self.breaks_at = float(breaks_at)
        self.lengths: FloatArray = np.full(
            len(points), checked_amount("rest_length", rest_length, LARGEST_COORDINATE)
        )
        """Length up to which each point is slack [m], shape (n,)."""
        self.sections: FloatArray = np.zeros(len(points))
        """Cross-section of each, where it is a fibre that the blade can cut [m2], shape (n,)."""
        self.toughness = 0.0
        """Energy of cutting them [J/m2]."""
        self.is_released = False
        """Whether it holds no more: it was released, or the force was too large."""
        self._states = np.zeros(len(points), dtype=np.int64)
        at = others.mean(axis=0) if origin is None else np.array(origin, dtype=np.float64)
        self._local: FloatArray = others - _triple("origin", at)
        self._begin = self._end = (np.eye(3), at)
        self._path: FramePath | None = None
        self._seconds, self._start = 0.0, self._end[1]
        self._force: FloatArray = np.zeros(3)
        self._moment: FloatArray = np.zeros(3)

    @property
    def n_points(self) -> int:
        """Number of points that it holds, without cut ones; 0 after it was released."""
        return 0 if self.is_released else int((self._states != SEVERED).sum())

    @property
    def wrench(self) -> Wrench:
        """Wrench of the tissue on the frame, averaged over the last step, about its origin now.

        Zero in the steps after the one in which it was released.
        """
        # Forces act where the points are: dampers pull off the line to what they are tied to.
        return Wrench(-self._force, -self._moment, np.zeros(3)).about(self._begin[1])

    def move(
        self, origin: Sequence[float] | FloatArray, rotation: npt.ArrayLike | None = None
    ) -> None:
        """Move the frame in the next step, at an even speed, to where it then stays.

        Args:
            origin: Its origin at the end of the step [m], shape (3,).
            rotation: Its axes as columns, shape (3, 3); at first they are those of the tissue.
                None: as they are.

        Raises:
            ValueError: a number is not finite, it is no rotation, or the other ends are in the
                tissue.
        """
        if self.to is not None:
            raise ValueError("its other ends are points of the tissue, which move with that")
        axes = self._end[0] if rotation is None else checked_rotation(rotation, "rotation")
        self._end = (axes, _triple("origin", np.array(origin, dtype=np.float64)))

    def follow(self, path: FramePath) -> None:
        """Move the frame along a path from now on, without turning, in place of `move`."""
        self._path, self._seconds, self._start = path, 0.0, self._end[1].copy()

    @property
    def way(self) -> tuple[Any, ...]:
        """Where the frame goes in the next step, by `move` or `follow`; none of it is written."""
        return self._end, self._path, self._seconds, self._start

    @way.setter
    def way(self, way: tuple[Any, ...]) -> None:
        self._end, self._path, self._seconds, self._start = way

    def advance(self, dt: float) -> None:
        """Follow the path, if there is one, by `dt` [s]; release the points when it says so."""
        if self._path is None:
            return
        if self._seconds >= self._path.release_at:
            self.is_released = True
        self._seconds += dt
        if self.to is not None:
            return
        self.move(self._start + self._path.at(self._seconds))

    def forget(self) -> None:
        """Forget the wrench of the last step: it holds no more."""
        self._force, self._moment = np.zeros(3), np.zeros(3)

    def targets(self) -> tuple[FloatArray, FloatArray]:
        """Return what the points are tied to at the begin and the end of the next step [m]."""
        first, last = (self._local @ axes.T + origin for axes, origin in (self._begin, self._end))
        return first, last

    def stop(self) -> None:
        """Put the frame where it was to be at the end of the next step."""
        self._begin = self._end

    def end_step(self, force: FloatArray, moment: FloatArray, states: IntArray) -> None:
        """Take what it did to the tissue, averaged over a step.

        Args:
            force: Sum of the forces [N], shape (3,).
            moment: Sum of their moments about the origin of the tissue's frame [N m], shape (3,).
            states: `Attachments.state` of its points, shape (n,).
        """
        self._begin, self._force, self._moment = self._end, force, moment
        self._states = states.copy()
        too_much = float(np.linalg.norm(force)) > self.breaks_at
        if too_much or (states == SEVERED).all():
            self.is_released = True


def _triple(name: str, values: FloatArray) -> FloatArray:
    """Return three finite numbers."""
    if values.shape != (3,) or not (np.abs(values) <= LARGEST_COORDINATE).all():  # false for NaN
        raise ValueError(
            f"{name} is {values.tolist()}; it is three finite numbers in m, of at most "
            f"{LARGEST_COORDINATE:g}"
        )
    return values


def expect_strength(name: str, value: float, unit: str) -> None:
    """Refuse a stiffness or a toughness that is not positive, or beyond that of any material.

    Raises:
        ValueError: it is.
    """
    if not 0.0 < value <= LARGEST_STRENGTH:
        raise ValueError(
            f"{name} is {value} {unit}; it must be positive and at most {LARGEST_STRENGTH:g}, far "
            "beyond that of steel"
        )


def checked_amount(name: str, value: float, most: float) -> float:
    """Return a number that is not negative, and at most `most`.

    Raises:
        ValueError: it is not.
    """
    if not 0.0 <= value <= most:
        raise ValueError(f"{name} is {value}; it must not be negative, and at most {most:g}")
    return float(value)


class Ligament(Attachment):
    """Fibres from points of a tissue to other places: each pulls where it is taut.

    The edge of the blade bends the fibres that it sweeps across, and cuts them
    (`tissue.forces.fibres`). The other ends are fixed to a frame, the world, until `move`; or they
    are points of the tissue: then a fibre tears where it is stretched until its energy is what
    cutting it costs.

    Args:
        points: The points of the tissue, each with its share of stiffness and cross-section.
        others: Where the fibres end [m], shape (n, 3).
        lengths: Length up to which each is slack [m], shape (n,).
        stiffness: Of all fibres together, along them [N/m].
        area: Cross-section of all fibres together [m2].
        toughness: Energy of cutting them [J/m2].
        damping: Of all of them together, along them [N s/m].
        breaks_at: Force of all of them at which they release the tissue [N].

    Raises:
        ValueError: a number is not finite, has the wrong sign, or is beyond `tissue.core.limits`.
    """

    def __init__(
        self,
        points: MaterialPoints,
        others: FloatArray,
        lengths: FloatArray,
        stiffness: float,
        area: float,
        toughness: float,
        damping: float = 0.0,
        breaks_at: float = math.inf,
    ) -> None:
        if not 0.0 < area <= LARGEST_COORDINATE:
            raise ValueError(
                f"area is {area} m2; it must be positive and at most {LARGEST_COORDINATE:g}"
            )
        expect_strength("toughness", toughness, "J/m2")
        super().__init__(points, others, stiffness=stiffness, damping=damping, breaks_at=breaks_at)
        self.lengths = lengths
        self.sections = area * points.shares
        self.toughness = float(toughness)


def ends_of_fibres(
    positions: FloatArray, to: npt.ArrayLike, rest_length: float | None
) -> tuple[FloatArray, FloatArray]:
    """Return where fibres end [m], shape (n, 3), and up to which length each is slack [m], (n,).

    Args:
        positions: Where they begin [m], shape (n, 3).
        to: Where they end [m], shape (n, 3), or (3,) for one place.
        rest_length: Length up to which each is slack [m]; None: the distance of its ends.

    Raises:
        ValueError: `to` has another shape or is not finite, or the length is negative.
    """
    others = np.array(to, dtype=np.float64)
    is_near = (np.abs(others) <= LARGEST_COORDINATE).all()  # false for NaN
    if others.shape not in ((3,), positions.shape) or not is_near:
        raise ValueError(
            f"to is {to!r}; it is one place in m, or one for each of the {len(positions)} points, "
            f"all finite and at most {LARGEST_COORDINATE:g}"
        )
    others = others + np.zeros_like(positions)
    if rest_length is None:
        return others, np.linalg.norm(others - positions, axis=1)
    return others, np.full(
        len(positions), checked_amount("rest_length", rest_length, LARGEST_COORDINATE)
    )
