"""Can the blade touch the tissue in this step? And which fixtures does it meet?

A strict filter: where it says no, the tissue would have found no active tetrahedron, so a run does
not depend on whether the filter is there.

One collision manager (python-fcl) holds a box around the tissue and one object for each fixture,
all in the tissue frame. The question is asked with the swept box of the blade: aligned with its
edge, and holding the edge at the start and at the end of the step and everything between, so that
a fast blade cannot pass through a thin body from one frame to the next.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import fcl
import numpy as np

from bridge.fixtures import Fixture, FixtureBox
from tissue.types import BladeSegment, BladeSweep, FloatArray

TOUCHING_MARGIN = 1e-6
"""[m], added to every side of both boxes. Two boxes that only touch are apart for the collision
library, and a box without thickness has no inside. A micrometre is a million times the rounding of
coordinates of a metre, and a thousandth of the smallest tetrahedron that anyone cuts."""


class Contacts(NamedTuple):
    """What the swept box of the blade meets."""

    tissue: bool
    """Whether it meets the box around the tissue."""
    fixtures: tuple[str, ...]
    """Names of the fixtures that it meets, in the order in which they were given."""


class SweptBox(NamedTuple):
    """A box around the edge at the start and at the end of a step, and all between."""

    centre: FloatArray
    """[m], shape (3,)."""
    size: FloatArray
    """Whole lengths of its edges [m], shape (3,)."""
    axes: FloatArray
    """Unit vectors as columns: forward, along the edge, across the blade; shape (3, 3)."""


class BroadPhase:
    """The collision manager, and the rule by which the tissue's box is kept large enough.

    The bounds of the tissue are those at the end of the last step. In the step to come a node may
    leave them, so the box is inflated by what a node can travel: `dt` times the sum of

    - the speed of sound in the tissue, that of compression. A node of an elastic body moves at
      strain times that speed, and tissue tears before its strain is 1;
    - the fastest that a side of the bounds moved in the last step, for a body (or a loose piece of
      it) that falls or swings as a whole.

    Args:
        bounds: Lowest and highest corner of the tissue now [m], shape (2, 3).
        sound_speed: Of the tissue [m/s].
        fixtures: In the tissue frame.

    Raises:
        ValueError: two fixtures have one name.
    """

    def __init__(
        self, bounds: FloatArray, sound_speed: float, fixtures: Iterable[Fixture] = ()
    ) -> None:
        self._bounds = bounds.copy()
        self._sound_speed = sound_speed
        self._bounds_speed = 0.0
        self._blade = _Box()
        self._tissue = _Box()
        # One geometry for each object, because a contact names only its geometry; and kept here,
        # because what the library holds are bare pointers.
        self._geometries: dict[str, fcl.CollisionGeometry] = {}
        self._objects = [self._tissue.object]
        for fixture in fixtures:
            if fixture.name in self._geometries:
                raise ValueError(f"two fixtures have the name {fixture.name!r}")
            geometry, pose = _geometry(fixture)
            self._geometries[fixture.name] = geometry
            self._objects.append(fcl.CollisionObject(geometry, pose))
        self._manager = fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects(self._objects)
        self._manager.setup()

    def contacts(self, sweep: BladeSweep, dt: float) -> Contacts:
        """Return what the blade can touch while it does `sweep` in `dt` [s]."""
        travel = (self._sound_speed + self._bounds_speed) * dt
        low, high = self._bounds
        size = high - low + 2.0 * (travel + TOUCHING_MARGIN)
        self._tissue.place(SweptBox(0.5 * (low + high), size, _UNTURNED))
        self._manager.update(self._tissue.object)
        self._blade.place(swept_box(sweep))
        met: set[int] = set()
        self._manager.collide(self._blade.object, met, _collect)
        return Contacts(
            id(self._tissue.geometry) in met,
            tuple(name for name, geometry in self._geometries.items() if id(geometry) in met),
        )

    def tissue_moved(self, bounds: FloatArray, dt: float) -> None:
        """Take note of where the tissue is after a step of `dt` [s]."""
        self._bounds_speed = float(np.abs(bounds - self._bounds).max()) / dt
        self._bounds = bounds.copy()


def swept_box(sweep: BladeSweep) -> SweptBox:
    """Return the box aligned with the edge at t1 that holds the edge during the whole step.

    A box is convex: when it holds both ends of the edge at both times, it holds every point that
    moves between them on a straight line.
    """
    axes = _edge_axes(sweep.t1)
    ends = np.array((sweep.t0.tip, sweep.t0.heel, sweep.t1.tip, sweep.t1.heel)) @ axes
    low, high = ends.min(axis=0), ends.max(axis=0)
    return SweptBox(axes @ (0.5 * (low + high)), high - low + 2.0 * TOUCHING_MARGIN, axes)


def _edge_axes(segment: BladeSegment) -> FloatArray:
    """Return orthonormal axes as columns: forward, along the edge, across the blade."""
    ex, ey, ez = (segment.tip - segment.heel).tolist()
    length = math.hypot(ex, ey, ez)
    ex, ey, ez = ex / length, ey / length, ez / length
    fx, fy, fz = segment.forward.tolist()
    nx, ny, nz = fy * ez - fz * ey, fz * ex - fx * ez, fx * ey - fy * ex
    length = math.hypot(nx, ny, nz)
    nx, ny, nz = nx / length, ny / length, nz / length
    fx, fy, fz = ey * nz - ez * ny, ez * nx - ex * nz, ex * ny - ey * nx
    return np.array(((fx, ex, nx), (fy, ey, ny), (fz, ez, nz)))


_UNTURNED = np.eye(3)


class _Box:
    """A collision object that changes its place and size in every step."""

    def __init__(self) -> None:
        self.geometry = fcl.Box(1.0, 1.0, 1.0)
        self.object = fcl.CollisionObject(self.geometry, fcl.Transform())

    def place(self, box: SweptBox) -> None:
        """Give the object this size and pose.

        The size alone would leave the old bounding volume in use; the order is part of the recipe.
        """
        self.geometry.side = box.size
        self.geometry.computeLocalAABB()
        self.object.setTransform(fcl.Transform(box.axes, box.centre))


def _geometry(fixture: Fixture) -> tuple[fcl.CollisionGeometry, fcl.Transform]:
    if isinstance(fixture, FixtureBox):
        return fcl.Box(*fixture.size), fcl.Transform(fixture.rotation, fixture.centre)
    mesh = fcl.BVHModel()
    mesh.beginModel(len(fixture.positions), len(fixture.triangles))
    mesh.addSubModel(fixture.positions, fixture.triangles)
    mesh.endModel()
    return mesh, fcl.Transform()


_ONE_CONTACT = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)


def _collect(one: fcl.CollisionObject, other: fcl.CollisionObject, met: set[int]) -> bool:
    """Add the geometries of two objects that meet to `met`, and go on.

    The library swallows what is raised in here, so nothing may be. One contact for each pair: with
    one list for all pairs, the triangles of a fixture could fill it before the tissue's turn.
    """
    result = fcl.CollisionResult()
    if fcl.collide(one, other, _ONE_CONTACT, result):
        met.add(id(result.contacts[0].o1))
        met.add(id(result.contacts[0].o2))
    return False
