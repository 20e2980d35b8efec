"""Numbers that say what a pixel shows: the same for each picture of a scene."""

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import mujoco
import numpy as np

from scalpel_sim.arm.free_names import free_name
from scalpel_sim.camera.composition import Thing
from scalpel_sim.camera.theatre import Theatre
from scalpel_sim.viewer.model_shapes import arm_bodies
from scalpel_sim.viewer.primitives import edge_in_geom
from tissue import IntArray

_NOTHING, _BLADE, _ARM, _WORLD = "nothing", "blade", "arm", "world"
"""Names of what there is besides the tissue and the graspers."""

_KINDS = mujoco.mjtObj
_OF_ARM = {int(kind) for kind in (_KINDS.mjOBJ_TENDON, _KINDS.mjOBJ_SITE, _KINDS.mjOBJ_SKIN)}
"""Kinds of parts of a model, besides geoms, that belong to arms."""


class IdentityTable(NamedTuple):
    """Numbers of what cameras see."""

    by_name: dict[str, int]
    """The numbers by the names that users see; 0 is `nothing`. What has the name of a part of the
    tissue is called otherwise."""
    blade: int
    graspers: dict[str, int]
    """Of each grasper, by its own name."""
    arm: int
    """Of the rest of the arms."""
    world: int


def identity_table(parts: Sequence[str], graspers: Iterable[str]) -> IdentityTable:
    """Return the numbers of nothing, the tissue, the blade, graspers, the arms, and the world.

    Args:
        parts: Names of the parts of the tissue, in order.
        graspers: Names of the graspers.
    """
    names, graspers = [_NOTHING, *parts], list(graspers)
    first = len(names)
    for name in (_BLADE, *graspers, _ARM, _WORLD):
        names.append(free_name(name, names))
    blade, *of_graspers, arm, world = range(first, len(names))
    return IdentityTable(
        {name: i for i, name in enumerate(names)},
        blade,
        dict(zip(graspers, of_graspers, strict=True)),
        arm,
        world,
    )


class Identities:
    """Numbers of what cameras see: tissue, blade, graspers, the rest of the arms, the world.

    They depend on the model and on the labels of the body, and not on what is in a picture.

    Args:
        theatre: What they see.
        parts: Names of the parts of the tissue, in order.
    """

    def __init__(self, theatre: Theatre, parts: Sequence[str]) -> None:
        numbers = identity_table(parts, theatre.graspers)
        self.table = numbers.by_name
        """The numbers by name; 0 is `nothing`."""
        self._parts = {name: self.table[name] for name in parts}
        self._arm, self._world = numbers.arm, numbers.world
        self._geoms = _numbers_of_geoms(theatre, numbers)

    def of(self, things: Iterable[Thing]) -> IntArray:
        """Return the numbers of things, with that of nothing as the last."""
        return np.array([*(self._of(thing) for thing in things), 0], np.int32)

    def _of(self, thing: Thing) -> int:
        """Return the number of a thing."""
        if thing.mesh is not None:
            return self._parts.get(thing.mesh, 0)  # ink has none, and no pixel shows it
        if thing.kind == int(mujoco.mjtObj.mjOBJ_GEOM):
            return int(self._geoms[thing.number])
        return self._arm if thing.kind in _OF_ARM else self._world


def _numbers_of_geoms(theatre: Theatre, numbers: IdentityTable) -> IntArray:
    """Return the numbers of the geoms of the model."""
    model = theatre.model
    bodies = model.geom_bodyid
    found = np.where(np.isin(bodies, arm_bodies(model)), numbers.arm, numbers.world)
    for name, grasper in theatre.graspers.items():
        own = [model.body(body).id for body in grasper.bodies]
        found[np.isin(bodies, own)] = numbers.graspers[name]
    if theatre.blade is not None:
        found[_blade_geoms(model, theatre.blade.body_id)] = numbers.blade
    return np.asarray(found, np.int32)


def _blade_geoms(model: mujoco.MjModel, body: int) -> list[int]:
    """Return the sheets of a body that carry the edge; all of its geoms where none does."""
    geoms = np.flatnonzero(model.geom_bodyid == body).tolist()
    is_box = {i for i in geoms if model.geom_type[i] == mujoco.mjtGeom.mjGEOM_BOX}
    return [i for i in geoms if i in is_box and edge_in_geom(model, i) is not None] or geoms


def names_of(table: Mapping[str, int], picture: IntArray) -> list[str]:
    """Return the names of what a picture shows, in the order of the table."""
    there = set(np.unique(picture).tolist())
    return [name for name, number in table.items() if number in there]
