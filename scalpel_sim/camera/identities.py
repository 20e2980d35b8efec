"""Numbers that say what a pixel shows: the same for each picture of a scene."""

from collections.abc import Iterable, Mapping, Sequence

import mujoco
import numpy as np

from scalpel_sim.arm.free_names import free_name
from scalpel_sim.camera.composition import Thing
from scalpel_sim.camera.theatre import Theatre
from scalpel_sim.viewer.primitives import edge_in_geom
from tissue import IntArray

_NOTHING, _BLADE, _ARM, _WORLD = "nothing", "blade", "arm", "world"
"""Names of what there is besides the tissue and the graspers."""

_KINDS = mujoco.mjtObj
_OF_ARM = {int(kind) for kind in (_KINDS.mjOBJ_TENDON, _KINDS.mjOBJ_SITE, _KINDS.mjOBJ_SKIN)}
"""Kinds of parts of a model, besides geoms, that belong to arms."""


class Identities:
    """Numbers of what cameras see: tissue, blade, graspers, the rest of the arms, the world.

    They hang on the model and on the labels of the body, and not on what is in a picture.

    Args:
        theatre: What they see.
        parts: Names of the parts of the tissue, in order.
    """

    def __init__(self, theatre: Theatre, parts: Sequence[str]) -> None:
        taken = [_NOTHING, *parts]
        own: list[str] = []
        for name in (_BLADE, *theatre.graspers, _ARM, _WORLD):
            own.append(free_name(name, [*taken, *own]))
        self.table: dict[str, int] = {name: i for i, name in enumerate([*taken, *own])}
        """The numbers by name; 0 is `nothing`."""
        self._parts = {name: self.table[name] for name in parts}
        self._arm, self._world = self.table[own[-2]], self.table[own[-1]]
        self._geoms = self._of_geoms(theatre, [self.table[name] for name in own])

    def of(self, things: Iterable[Thing]) -> IntArray:
        """Return the numbers of things, with that of nothing as the last."""
        return np.array([*(self._of(thing) for thing in things), 0], np.int32)

    def _of(self, thing: Thing) -> int:
        """Return the number of a thing."""
        if thing.mesh is not None:
            return self._parts[thing.mesh]
        if thing.kind == int(mujoco.mjtObj.mjOBJ_GEOM):
            return int(self._geoms[thing.number])
        return self._arm if thing.kind in _OF_ARM else self._world

    def _of_geoms(self, theatre: Theatre, numbers: Sequence[int]) -> IntArray:
        """Return the numbers of the geoms of the model."""
        model = theatre.model
        roots, bodies = model.body_rootid, model.geom_bodyid
        moves = np.zeros(model.nbody, bool)
        moves[roots[model.dof_bodyid]] = True
        found = np.where(moves[roots[bodies]], self._arm, self._world)
        blade, *graspers = numbers[:-2]
        for number, grasper in zip(graspers, theatre.graspers.values(), strict=True):
            found[np.isin(bodies, [model.body(name).id for name in grasper.bodies])] = number
        if theatre.blade is not None:
            found[_blade_geoms(model, theatre.blade.body_id)] = blade
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
