"""Objects of the collision library (python-fcl), used only where it is safe.

The package avoids each of these, because it was seen to end the process or to answer wrongly:

- `continuousCollide` with a mesh crashes, or reports no hit for a pass through it. A fast body is
  represented by a box around its whole path instead.
- `beginModel` on a mesh that is built, and a query on one that is not, crash. A mesh is built once,
  here.
- `distance` to a mesh is positive where the two overlap.
- An exception raised in a callback is printed and lost.
- After `clear` of a manager, or when an object is registered twice, the manager keeps both.
- A manager of many objects is slow for a long rotated one: it bounds that by a sphere, and tests
  all objects that the sphere overlaps.
- A pose that is not finite is accepted silently. Poses are checked where they come in.
"""

import fcl

from bridge.collision.fixtures import Fixture, FixtureBox
from bridge.collision.swept_box import SweptBox


class MovableBox:
    """A box of the collision library whose pose and size can change."""

    def __init__(self) -> None:
        self.geometry = fcl.Box(1.0, 1.0, 1.0)
        self.object = fcl.CollisionObject(self.geometry, fcl.Transform())

    def place(self, box: SweptBox) -> None:
        """Set size and pose.

        The order matters: the size alone would leave the old bounding volume in use.
        """
        self.geometry.side = box.size
        self.geometry.computeLocalAABB()
        self.object.setTransform(fcl.Transform(box.axes, box.centre))


class Obstacles:
    """Named objects in one collision manager.

    Args:
        objects: Geometry and object by name. A contact identifies only its geometry, so each object
            must have its own. They are kept here, because the library holds bare pointers.
    """

    def __init__(self, objects: dict[str, tuple[fcl.CollisionGeometry, fcl.CollisionObject]]):
        self._objects = objects
        self._manager = fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects([obstacle for _, obstacle in objects.values()])
        self._manager.setup()

    def update(self) -> None:
        """Read the poses of the objects; whoever moves them calls this."""
        if self._objects:
            self._manager.update()

    def colliding_with(self, other: fcl.CollisionObject) -> tuple[str, ...]:
        """Return the names of the obstacles that collide with another object, in order."""
        if not self._objects:
            return ()
        found: set[int] = set()
        self._manager.collide(other, found, _collect)
        if not found:
            return ()
        return tuple(name for name, (shape, _) in self._objects.items() if id(shape) in found)


def are_colliding(one: fcl.CollisionObject, other: fcl.CollisionObject) -> bool:
    """Return whether two objects collide, by their exact shapes."""
    return bool(fcl.collide(one, other, _ONE_CONTACT, fcl.CollisionResult()))


def fixture_objects(
    fixtures: list[Fixture],
) -> dict[str, tuple[fcl.CollisionGeometry, fcl.CollisionObject]]:
    """Return the geometries and objects of fixtures by name.

    Raises:
        ValueError: two fixtures have one name.
    """
    objects = {}
    for fixture in fixtures:
        if fixture.name in objects:
            raise ValueError(f"two fixtures have the name {fixture.name!r}")
        geometry, pose = _geometry(fixture)
        objects[fixture.name] = geometry, fcl.CollisionObject(geometry, pose)
    return objects


def _geometry(fixture: Fixture) -> tuple[fcl.CollisionGeometry, fcl.Transform]:
    """Return a new geometry for a fixture, and its pose."""
    if isinstance(fixture, FixtureBox):
        return fcl.Box(*fixture.size), fcl.Transform(fixture.rotation, fixture.centre)
    mesh = fcl.BVHModel()
    mesh.beginModel(len(fixture.positions), len(fixture.triangles))
    mesh.addSubModel(fixture.positions, fixture.triangles)
    mesh.endModel()
    return mesh, fcl.Transform()


_ONE_CONTACT = fcl.CollisionRequest(num_max_contacts=1, enable_contact=False)


def _collect(one: fcl.CollisionObject, other: fcl.CollisionObject, found: set[int]) -> bool:
    """Add the geometries of two objects to `found` if they collide; return False to continue.

    One contact is requested per pair: in one list for all pairs, the triangles of a fixture could
    take all places before the other pairs are tested.
    """
    result = fcl.CollisionResult()
    if fcl.collide(one, other, _ONE_CONTACT, result):
        found.add(id(result.contacts[0].o1))
        found.add(id(result.contacts[0].o2))
    return False
