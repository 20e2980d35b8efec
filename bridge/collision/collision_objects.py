"""Objects of the collision library (python-fcl), and the ways of using it that do not crash it.

None of these is called anywhere, for each was seen to end the process or to answer wrongly:

- `continuousCollide` with a mesh: it crashes, or reports no hit for a pass through. A fast body is
  a box around its whole way instead.
- `beginModel` on a mesh that is built, and a query on one that is not: they crash. A mesh is built
  once, here.
- `distance` to a mesh: it is positive where the two overlap.
- a callback that raises: the exception is printed and lost.
- `clear` of a manager, and registering an object twice: the manager keeps both.
- a manager of many objects, asked with a long one that is turned: no crash, but it holds what is
  turned by the ball around it, and looks at all that the ball meets.
- a pose that is not finite: it is taken silently. Poses are checked where they come in.
"""

import fcl

from bridge.collision.fixtures import Fixture, FixtureBox
from bridge.collision.swept_box import SweptBox


class MovableBox:
    """A collision object that changes its place and size."""

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


class Obstacles:
    """Named objects in one collision manager, and which of them another object meets.

    Args:
        objects: Names, and the objects. A contact names only its geometry, so each object must have
            its own. They are kept here, because the library holds bare pointers.
    """

    def __init__(self, objects: dict[str, tuple[fcl.CollisionGeometry, fcl.CollisionObject]]):
        self._objects = objects
        self._manager = fcl.DynamicAABBTreeCollisionManager()
        self._manager.registerObjects([thing for _, thing in objects.values()])
        self._manager.setup()

    def met_by(self, other: fcl.CollisionObject) -> tuple[str, ...]:
        """Return the names of those that meet an object which is not one of them, in order."""
        if not self._objects:
            return ()
        met: set[int] = set()
        self._manager.collide(other, met, _collect)
        if not met:
            return ()
        return tuple(name for name, (shape, _) in self._objects.items() if id(shape) in met)


def meet(one: fcl.CollisionObject, other: fcl.CollisionObject) -> bool:
    """Whether two objects meet, by their exact shapes."""
    return bool(fcl.collide(one, other, _ONE_CONTACT, fcl.CollisionResult()))


def fixture_object(fixture: Fixture) -> tuple[fcl.CollisionGeometry, fcl.CollisionObject]:
    """Return a geometry of its own, and the object."""
    geometry, pose = _geometry(fixture)
    return geometry, fcl.CollisionObject(geometry, pose)


def fixture_objects(
    fixtures: list[Fixture],
) -> dict[str, tuple[fcl.CollisionGeometry, fcl.CollisionObject]]:
    """Return the objects of fixtures by name.

    Raises:
        ValueError: two have one name.
    """
    objects = {}
    for fixture in fixtures:
        if fixture.name in objects:
            raise ValueError(f"two fixtures have the name {fixture.name!r}")
        objects[fixture.name] = fixture_object(fixture)
    return objects


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

    One contact for each pair: with one list for all pairs, the triangles of a fixture could fill it
    before the others' turn.
    """
    result = fcl.CollisionResult()
    if fcl.collide(one, other, _ONE_CONTACT, result):
        met.add(id(result.contacts[0].o1))
        met.add(id(result.contacts[0].o2))
    return False
