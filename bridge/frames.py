"""World frame to tissue frame and back: the only file where a vector changes frame."""

from dataclasses import dataclass, field, replace

import numpy as np

from bridge.checks import finite, rotation
from bridge.fixtures import Fixture, FixtureBox
from tissue.types import BladeSegment, FloatArray, Wrench


@dataclass(frozen=True, eq=False)
class TissueFrame:
    """Where the tissue lies in the world: x_world = rotation @ x_tissue + origin. Fixed for a run.

    Raises:
        ValueError: the rotation is not one (orthonormal, determinant +1), or a number is not
            finite.
    """

    rotation: FloatArray = field(default_factory=lambda: np.eye(3))
    """The tissue's axes in the world as columns, shape (3, 3)."""
    origin: FloatArray = field(default_factory=lambda: np.zeros(3))
    """The tissue's origin in the world [m], shape (3,)."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", rotation(self.rotation, "the tissue's rotation"))
        object.__setattr__(self, "origin", finite(self.origin, (3,), "the tissue's origin"))
        self.rotation.setflags(write=False)
        self.origin.setflags(write=False)

    def points_to_tissue(self, points: FloatArray) -> FloatArray:
        """Return world points in the tissue frame [m], shape (..., 3)."""
        return (points - self.origin) @ self.rotation

    def points_to_world(self, points: FloatArray) -> FloatArray:
        """Return points of the tissue frame in the world [m], shape (..., 3)."""
        return points @ self.rotation.T + self.origin

    def vectors_to_tissue(self, vectors: FloatArray) -> FloatArray:
        """Return world vectors (directions, forces, velocities) in the tissue frame, (..., 3)."""
        return vectors @ self.rotation

    def vectors_to_world(self, vectors: FloatArray) -> FloatArray:
        """Return vectors of the tissue frame in the world, shape (..., 3)."""
        return vectors @ self.rotation.T

    def segment_to_tissue(self, segment: BladeSegment) -> BladeSegment:
        """Return a world segment in the tissue frame."""
        return BladeSegment(
            self.points_to_tissue(segment.tip),
            self.points_to_tissue(segment.heel),
            self.vectors_to_tissue(segment.forward),
        )

    def segment_to_world(self, segment: BladeSegment) -> BladeSegment:
        """Return a segment of the tissue frame in the world."""
        return BladeSegment(
            self.points_to_world(segment.tip),
            self.points_to_world(segment.heel),
            self.vectors_to_world(segment.forward),
        )

    def wrench_to_world(self, wrench: Wrench) -> Wrench:
        """Return a wrench of the tissue frame in the world; its point is the same point.

        What is infinite may become NaN. The coupling refuses both, so it is no news for a terminal.
        """
        with np.errstate(invalid="ignore"):
            return Wrench(
                self.vectors_to_world(wrench.force),
                self.vectors_to_world(wrench.torque),
                self.points_to_world(wrench.point),
            )

    def fixture_to_tissue(self, fixture: Fixture) -> Fixture:
        """Return a fixture that stands in the world in the tissue frame."""
        if isinstance(fixture, FixtureBox):
            return replace(
                fixture,
                centre=self.points_to_tissue(fixture.centre),
                rotation=self.rotation.T @ fixture.rotation,
            )
        return replace(fixture, positions=self.points_to_tissue(fixture.positions))
