"""World frame to tissue frame and back, and a wrench about another point.

No other module of the package changes the frame of a vector.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from bridge.arithmetic import Six, Three, Triple
from bridge.collision.fixtures import Fixture, FixtureBox
from bridge.poses import finite, rotation
from tissue import BladeSegment, FloatArray, Wrench


@dataclass(frozen=True, eq=False)
class TissueFrame:
    """Pose of the tissue in the world: x_world = rotation @ x_tissue + origin. Fixed for a run.

    Raises:
        ValueError: the rotation is not orthonormal with determinant +1, or a number is not finite.
    """

    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """Axes of the tissue in the world as columns, shape (3, 3)."""
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))
    """Origin of the tissue in the world [m], shape (3,)."""
    is_rotated: bool = field(init=False, repr=False, default=True)
    """Whether the rotation differs from the identity. Mostly it does not, and the products are
    skipped."""
    numbers_of_origin: Three = field(init=False, repr=False, default=(0.0, 0.0, 0.0))
    """The origin in plain numbers [m]."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", rotation(self.rotation, "the tissue's rotation"))
        object.__setattr__(self, "origin", finite(self.origin, (3,), "the tissue's origin"))
        object.__setattr__(self, "is_rotated", bool((self.rotation != np.eye(3)).any()))
        object.__setattr__(self, "numbers_of_origin", tuple(self.origin.tolist()))
        self.rotation.setflags(write=False)
        self.origin.setflags(write=False)

    def points_to_tissue(self, points: FloatArray) -> FloatArray:
        """Return world points in the tissue frame [m], shape (..., 3)."""
        return self.vectors_to_tissue(points - self.origin)

    def points_to_world(self, points: FloatArray) -> FloatArray:
        """Return points of the tissue frame in the world [m], shape (..., 3)."""
        return self.vectors_to_world(points) + self.origin

    def vectors_to_tissue(self, vectors: FloatArray) -> FloatArray:
        """Return world vectors (direction, force, velocity) in the tissue frame, shape (..., 3)."""
        return vectors @ self.rotation if self.is_rotated else vectors.copy()

    def vectors_to_world(self, vectors: FloatArray) -> FloatArray:
        """Return vectors of the tissue frame in the world, shape (..., 3)."""
        return vectors @ self.rotation.T if self.is_rotated else vectors.copy()

    def matrix_to_world(self, matrix: FloatArray) -> FloatArray:
        """Return a matrix of the tissue frame, such as a stiffness, in the world, shape (3, 3)."""
        return self.rotation @ matrix @ self.rotation.T if self.is_rotated else matrix.copy()

    def segment_to_tissue(self, segment: BladeSegment) -> BladeSegment:
        """Return a world segment in the tissue frame."""
        if not self.is_rotated:
            x, y, z = self.numbers_of_origin
            a, b, c, d, e, f, u, v, w = segment.numbers
            return BladeSegment.of_numbers((a - x, b - y, c - z, d - x, e - y, f - z, u, v, w))
        tip, heel, forward = segment
        return BladeSegment(
            self.points_to_tissue(tip),
            self.points_to_tissue(heel),
            self.vectors_to_tissue(forward),
        )

    def segment_to_world(self, segment: BladeSegment) -> BladeSegment:
        """Return a segment of the tissue frame in the world."""
        if not self.is_rotated:
            x, y, z = self.numbers_of_origin
            a, b, c, d, e, f, u, v, w = segment.numbers
            return BladeSegment.of_numbers((a + x, b + y, c + z, d + x, e + y, f + z, u, v, w))
        tip, heel, forward = segment
        return BladeSegment(
            self.points_to_world(tip),
            self.points_to_world(heel),
            self.vectors_to_world(forward),
        )

    def wrench_to_world(self, wrench: Wrench) -> Wrench:
        """Return a wrench of the tissue frame in the world, about the same point."""
        if not self.is_rotated:
            x, y, z = self.numbers_of_origin
            fx, fy, fz, tx, ty, tz, px, py, pz = wrench.numbers
            return Wrench.of_numbers((fx, fy, fz, tx, ty, tz, px + x, py + y, pz + z))
        force, torque, point = wrench
        return Wrench(
            self.vectors_to_world(force),
            self.vectors_to_world(torque),
            self.points_to_world(point),
        )

    def numbers_to_world(self, wrench: Six, point: Triple) -> Wrench:
        """Return force [N] and torque [N m] of the tissue frame about a point, in the world."""
        px, py, pz = point
        if self.is_rotated:
            return self.wrench_to_world(Wrench.of_numbers((*wrench, px, py, pz)))
        x, y, z = self.numbers_of_origin
        fx, fy, fz, tx, ty, tz = wrench
        return Wrench.of_numbers((fx, fy, fz, tx, ty, tz, px + x, py + y, pz + z))

    def fixture_to_tissue(self, fixture: Fixture) -> Fixture:
        """Return a fixture given in the world in the tissue frame."""
        if isinstance(fixture, FixtureBox):
            return replace(
                fixture,
                centre=self.points_to_tissue(fixture.centre),
                rotation=self.rotation.T @ fixture.rotation,
            )
        return replace(fixture, positions=self.points_to_tissue(fixture.positions))


def wrench_about(wrench: Wrench, point: FloatArray) -> FloatArray:
    """Return force [N] and torque about a point [N m] of a wrench, shape (6,)."""
    x, y, z = (wrench.point - point).tolist()
    fx, fy, fz = wrench.force.tolist()
    tx, ty, tz = wrench.torque.tolist()
    return np.array((fx, fy, fz, tx + y * fz - z * fy, ty + z * fx - x * fz, tz + x * fy - y * fx))
