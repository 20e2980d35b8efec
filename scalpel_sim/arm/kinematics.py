"""Facts of an arm that the search for a place needs: where it can stand, and what it reaches."""

from typing import NamedTuple, Protocol

import numpy as np

from tissue import BoolArray, FloatArray


class Spheres(NamedTuple):
    """Spheres that cover an arm along its way, at some instants. Tissue frame."""

    centres: FloatArray
    """Their centres [m], shape (n_instants, n, 3)."""
    radii: FloatArray
    """Their radii [m], shape (n,)."""


class InstrumentPath(NamedTuple):
    """Poses of the blade's body along a stroke, tissue frame."""

    positions: FloatArray
    """Origin of the blade's body [m], shape (n, 3)."""
    axes: FloatArray
    """Axes of the blade's body as columns, shape (n, 3, 3)."""
    lowest: float
    """Lowest height of the blade along the stroke, and of what lies there [m]."""
    boxes: FloatArray
    """Lowest and highest corners of what lies there: tissue, a table's board [m], (n, 2, 3)."""
    table: float | None = None
    """Height of a table that is there [m]; None: it is where the arm needs it."""

    @property
    def middle(self) -> FloatArray:
        """Middle of the box around the positions [m], shape (3,)."""
        return np.asarray((self.positions.min(axis=0) + self.positions.max(axis=0)) / 2.0)


class Places(NamedTuple):
    """Candidate places of the base, tissue frame; arrays of one length."""

    yaws: FloatArray
    """Angles by which the base is turned about +z [rad], shape (n,)."""
    bases: FloatArray
    """Where the origin of the base is [m], shape (n, 3)."""


class Fit(NamedTuple):
    """Fit of the base of an arm at places."""

    can_stand: BoolArray
    """Whether it can stand there at all, shape (n,)."""
    is_awkward: BoolArray
    """Whether any other place is better, such as one on a column."""


class Reach(NamedTuple):
    """Whether, and how comfortably, an arm reaches poses."""

    angles: FloatArray
    """Positions of its joints [rad, m], shape (..., n_joints). Where a joint cannot move far
    enough, the nearest that it can."""
    margin: FloatArray
    """Smallest distance of a joint from an end of its range, as a fraction of half the range:
    1 in the middle, negative beyond. Shape (...)."""


class ArmPoses(NamedTuple):
    """Poses of an arm: n along a path, or one from n bases."""

    path: InstrumentPath
    """Poses of its instrument, n or one."""
    angles: FloatArray
    """Positions of its joints [rad, m], shape (n, n_joints)."""
    bases: FloatArray
    """Places of its base, tissue frame [m], shape (n, 3)."""
    turns: FloatArray
    """Axes of its base as columns, shape (n, 3, 3)."""
    mount_angle: float
    """Angle between its instrument and the blade [rad]."""


class Kinematics(Protocol):
    """Kinematics of one of the project's arms, many poses at once."""

    @property
    def stands_on_table(self) -> bool:
        """Whether the underside of its base is its origin, which stands on a table."""

    def places(self, path: InstrumentPath) -> Places:
        """Return the places that a search tries for a path."""

    def reach(self, positions: FloatArray, axes: FloatArray, mount_angle: float) -> Reach:
        """Return the joints that put the blade's body at poses relative to the base.

        Args:
            positions: Origin of the blade's body, in the frame of the base [m], shape (..., 3).
                The last axis but one is along a path.
            axes: Axes of the blade's body as columns, in the frame of the base, shape (..., 3, 3).
            mount_angle: Between the instrument and the blade [rad].
        """

    def fit(self, path: InstrumentPath, bases: FloatArray) -> Fit:
        """Return how the base fits at places [m], shape (n, 3), beside what lies there."""

    def links(self, angles: FloatArray) -> FloatArray:
        """Return points along its links, in the frame of the base [m], shape (..., n, 3)."""

    def spheres(self, poses: ArmPoses) -> Spheres:
        """Return spheres that cover the arm, and not what it holds."""


TABLE_CLEARANCE = 0.01
"""Distance of the table from the lowest point of blade and body [m]: the blade passes beneath the
body."""


def margin_in(angles: FloatArray, ranges: FloatArray) -> FloatArray:
    """Return the smallest distance of joints from the ends of their ranges, over half the range.

    Args:
        angles: Positions of the joints, shape (..., n).
        ranges: Their lowest and highest ones, shape (n, 2); what is not finite is no limit.
    """
    low, high = ranges[np.isfinite(ranges).all(axis=1)].T
    watched = angles[..., np.isfinite(ranges).all(axis=1)]
    margins = np.minimum(watched - low, high - watched) / (0.5 * (high - low))
    return np.asarray(margins.min(axis=-1))


def turns_about_z(yaws: FloatArray) -> FloatArray:
    """Return the axes of bases that are turned about +z [rad], as columns, shape (n, 3, 3)."""
    c, s, zero = np.cos(yaws), np.sin(yaws), np.zeros_like(yaws)
    return np.stack([c, -s, zero, s, c, zero, zero, zero, zero + 1.0], axis=1).reshape(-1, 3, 3)


def distance_to_boxes(points: FloatArray, boxes: FloatArray) -> FloatArray:
    """Return how far points are from the nearest box [m]; 0 inside.

    Args:
        points: Shape (..., d).
        boxes: Lowest and highest corners, shape (n, 2, d).
    """
    apart = [
        np.linalg.norm(np.maximum(np.maximum(low - points, points - high), 0.0), axis=-1)
        for low, high in boxes
    ]
    return np.asarray(np.min(apart, axis=0))


def separate_components(vectors: FloatArray) -> FloatArray:
    """Return the components of vectors, each without gaps in memory, shape (n, ...).

    NumPy's functions take an array with gaps to reach beyond its end. Where the result happens to
    lie there, they go another way, of which the last bit differs: 2.0 does so in `arctan2`.

    Args:
        vectors: Shape (..., n).
    """
    return np.ascontiguousarray(np.moveaxis(vectors, -1, 0))
