"""Names for what the program adds to a model of the user's, where they are free."""

import itertools
from collections.abc import Iterable, Iterator, Mapping

import mujoco

KINDS = (
    "actuators",
    "bodies",
    "cameras",
    "equalities",
    "excludes",
    "flexes",
    "frames",
    "geoms",
    "hfields",
    "joints",
    "keys",
    "lights",
    "materials",
    "meshes",
    "numerics",
    "pairs",
    "plugins",
    "sensors",
    "sites",
    "skins",
    "tendons",
    "texts",
    "textures",
    "tuples",
)
"""Kinds of elements of a model as `MjSpec` lists them. In each a name may occur once."""

_OURS = "scalpel_sim_"
"""Prefix of a name that the user's model has already."""


def free_prefix(spec: mujoco.MjSpec, names: Mapping[str, Iterable[str]], usual: str = "") -> str:
    """Return a prefix with which no element of a model has one of the names already.

    It is the usual one where that is free.

    Args:
        spec: The model, yet to be compiled.
        names: Names that are to be added, by their kind: one of `KINDS`.
        usual: Prefix that is tried first.
    """
    taken = {kind: _names_of(spec, kind) for kind in names}
    wanted = [(kind, name) for kind, named in names.items() for name in named]
    return next(
        prefix
        for prefix in _tried(usual)
        if not any(prefix + name in taken[kind] for kind, name in wanted)
    )


def free_name(wanted: str, taken: Iterable[str]) -> str:
    """Return a name that is not taken: the wanted one where that is free."""
    there = set(taken)
    return next(name for name in _tried(wanted) if name not in there)


def names_in(spec: mujoco.MjSpec) -> dict[str, set[str]]:
    """Return the names that a model has, by their kind."""
    return {kind: _names_of(spec, kind) for kind in KINDS}


def _names_of(spec: mujoco.MjSpec, kind: str) -> set[str]:
    """Return the names of one kind; what has no name takes none."""
    return {each.name for each in getattr(spec, kind)} - {""}


def _tried(usual: str) -> Iterator[str]:
    """Yield what is tried, one after the other."""
    yield usual
    yield _OURS + usual
    for number in itertools.count(2):
        yield f"{_OURS}{number}_{usual}"
