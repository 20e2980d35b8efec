"""`Identity`: which body, under which settings and in which version a state is of."""

import dataclasses
import hashlib
import importlib.metadata
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple, Self

from tissue.blade_shape import BladeShape
from tissue.core.memento_reading import StateError
from tissue.core.vec3 import Vec3
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.solver_settings import SolverSettings

STATE_FORMAT = 12
"""Number of the form of a state in bytes. It rises where the form changes."""

_FREE = ("solver.threads",)
"""Settings that change no bit."""


def version_now() -> str:
    """Return the version of this program, and the form of its states."""
    try:
        version = importlib.metadata.version("scalpel-sim")
    except importlib.metadata.PackageNotFoundError:
        version = "source"
    return f"{version} (form {STATE_FORMAT})"


class Identity(NamedTuple):
    """Properties that a state shares with the tissue that it is loaded into."""

    version: str
    """Version of the program."""
    n_nodes: int
    """Number of nodes before any cut."""
    n_tetrahedra: int
    """Number of tetrahedra before any cut."""
    body: str
    """Digest of the body before any cut: mesh, fixed nodes and where the nodes were."""
    settings: Mapping[str, str]
    """Settings by their names, as text."""

    @classmethod
    def of(
        cls,
        body: Body,
        gravity: Vec3,
        materials: Mapping[int, Material],
        blade: BladeShape | None,
        floor: float | None,
        solver: SolverSettings,
    ) -> Self:
        """Return the identity of a tissue before any cut.

        Args:
            body: The body.
            gravity: Acceleration of free fall [m/s2].
            materials: What it is made of, by label.
            blade: The body of the blade.
            floor: Height of the floor [m].
            solver: How it is cut and moved.
        """
        nodes, tetrahedra = body.n_nodes, body.n_tetrahedra
        digest = hashlib.blake2b(digest_size=16)
        for array in (body.rest, body.positions, body.fixed):
            digest.update(array[:nodes].tobytes())
        digest.update(body.tetrahedra[:tetrahedra].tobytes())
        digest.update(body.materials.label[body.material[:tetrahedra]].tobytes())
        parts = {"blade": blade, "solver": solver}
        settings = {"gravity": repr(tuple(gravity)), "floor": repr(floor)}
        for label, material in materials.items():
            name = "material" if len(materials) == 1 else f"material of label {label}"
            settings |= {f"{name}.{key}": repr(each) for key, each in material.as_keys().items()}
        layers = body.interfaces
        for (low, high), toughness in zip(layers.label.tolist(), layers.toughness, strict=True):
            settings[f"toughness between labels {low} and {high}"] = repr(float(toughness))
        settings |= {name: value for part in parts.items() for name, value in _flat(*part)}
        for name in _FREE:
            del settings[name]
        return cls(version_now(), nodes, tetrahedra, digest.hexdigest(), settings)

    def expect(self, other: "Identity") -> None:
        """Refuse a state of another identity.

        Raises:
            StateError: the message says what differs.
        """
        if other.version != self.version:
            raise StateError(
                f"the state was saved by version {other.version}, and this is {self.version}: load "
                "it with the version that saved it"
            )
        if other.body != self.body:
            raise StateError(
                f"the state is of another body: that had {other.n_nodes} nodes and "
                f"{other.n_tetrahedra} tetrahedra before any cut, and this one {self.n_nodes} and "
                f"{self.n_tetrahedra}"
                + (", placed or fixed otherwise" if other[1:3] == self[1:3] else "")
            )
        theirs, ours = dict(other.settings), dict(self.settings)
        if theirs != ours:
            names = sorted({*theirs, *ours})
            found = [
                f"{name} is {theirs.get(name, 'not set')} there and {ours.get(name, 'not set')} "
                "here"
                for name in names
                if theirs.get(name) != ours.get(name)
            ]
            raise StateError(f"the state is of other settings: {'; '.join(found)}")


def _flat(name: str, value: Any) -> Iterator[tuple[str, str]]:
    """Yield the fields of a dataclass, those inside others too, with their values as text."""
    if not dataclasses.is_dataclass(value):
        yield name, repr(value)
        return
    for each in dataclasses.fields(value):
        yield from _flat(f"{name}.{each.name}", getattr(value, each.name))
