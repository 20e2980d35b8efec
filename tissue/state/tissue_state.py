"""`TissueState`: a tissue at one time, in memory or as bytes."""

import io
import json
import zipfile
from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, NamedTuple, Self

import numpy as np

from tissue.contact.geoms.geom import Geom
from tissue.core.memento import Memento, Spares, StateRules
from tissue.core.memento_reading import StateError, put_to, written
from tissue.loads.attachment import Attachment, FramePath, Ligament
from tissue.loads.load import Load
from tissue.loads.material_points import MaterialPoints
from tissue.loads.support_path import SupportPath
from tissue.state.identity import Identity
from tissue.state.memory_in_use import STRUCTS

_TREE = "tree"
"""Name of the JSON in the bytes of a state."""

_BESIDE = "beside_"
"""Beginning of the names of arrays that are written with a state."""

NOTHING: Mapping[str, np.ndarray] = MappingProxyType({})
"""No arrays."""


def _none() -> None:
    return None


RULES = StateRules(
    packages=frozenset({"tissue"}),
    kept=frozenset(
        {"Material", "BladeShape", "SolverSettings", "CutSettings", "Identity", "Spares"}
        | {"CheckedSteps", "Hierarchical", "SameTypes"}
    ),
    derived={
        "BladeInteraction._context": _none,
        "BladeInteraction._views": dict,
        "TissueModel._context": _none,
        "TissueModel._parts": tuple,
        "GlobalStepper._relaxation": _none,
        "GlobalStepper._parts": tuple,
        "StepStages._frame": _none,
        "StepStages._parts": tuple,
        "StepStages._n_made": int,
        "Scheme._cut": _none,
        "BodyChunks._nodes": _none,
    },
    own=frozenset({"GlobalStepper._threads"}),
    structs=STRUCTS,
    made={
        kind.__name__: kind
        for kind in (Attachment, FramePath, Geom, Ligament, Load, MaterialPoints, SupportPath)
    },
)
"""Parts of a tissue that are its state."""


class Around(NamedTuple):
    """A tree of objects that refers to a tissue, and is put to a state with it."""

    root: Any
    """Its root."""
    rules: StateRules
    """Parts of it that are no state; the tissue has rules of its own."""


class TissueState:
    """A tissue at one time: mesh, motion, cuts and all that the next step depends on.

    It is made by `Tissue.save_state`, or from bytes, and does not change.
    """

    def __init__(
        self, identity: Identity, memento: Memento | None, content: dict[str, np.ndarray] | None
    ) -> None:
        self._identity = identity
        self._memento = memento
        self._content = content

    @classmethod
    def of(cls, tissue: Any, identity: Identity, spares: Spares) -> Self:
        """Return the state of a tissue now."""
        return cls(identity, Memento(tissue, RULES, spares), None)

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Return the state that `to_bytes` wrote.

        Raises:
            StateError: the bytes are no state, or not all of one.
        """
        try:
            with np.load(io.BytesIO(data), allow_pickle=False) as file:
                content = {name: file[name] for name in file.files}
            tree = json.loads(content[_TREE].tobytes())
            identity = Identity(*(tree["identity"][name] for name in Identity._fields))
        except (ValueError, KeyError, OSError, EOFError, zipfile.BadZipFile) as error:
            raise StateError(
                f"these {len(data)} bytes are no state of a tissue, or a part of one is missing or "
                f"damaged ({error}): take another one"
            ) from error
        return cls(identity, None, content)

    def to_bytes(
        self, around: Memento | None = None, beside: Mapping[str, np.ndarray] = NOTHING
    ) -> bytes:
        """Return the state as bytes: a NumPy archive (`.npz`) of plain arrays and one of JSON.

        Args:
            around: A tree that refers to the tissue, of the same time, which is written with it.
            beside: Arrays that are written with it, by their names.
        """
        file = io.BytesIO()
        others = {f"{_BESIDE}{name}": array for name, array in beside.items()}
        np.savez(file, allow_pickle=False, **self._written(around), **others)
        return file.getvalue()

    def beside(self, name: str) -> np.ndarray:
        """Return an array that was written with a state from bytes.

        Raises:
            StateError: there is none of that name.
        """
        found = None if self._content is None else self._content.get(f"{_BESIDE}{name}")
        if found is None:
            raise StateError(f"the state has no part '{name}': it is of a tissue alone")
        return found

    def expect_of(self, identity: Identity) -> None:
        """Refuse to be of a tissue with another identity.

        Raises:
            StateError: the message says what differs.
        """
        identity.expect(self._identity)

    def load_into(self, tissue: Any, identity: Identity, around: Around | None = None) -> None:
        """Put a tissue to this state.

        Raises:
            StateError: it is not of that tissue; the tissue is as it was.
        """
        if self._memento is not None and self._memento.root is tissue:
            self._memento.restore()
            return
        self.expect_of(identity)
        content = self._written()
        root, rules = (tissue, RULES) if around is None else around
        both = RULES if around is None else rules.with_others(RULES)
        put_to(root, json.loads(content[_TREE].tobytes()), content, both)

    def _written(self, around: Memento | None = None) -> dict[str, np.ndarray]:
        """Return the state as arrays by their names."""
        if self._content is not None:
            return self._content
        assert self._memento is not None
        tree, arrays = written(self._memento, around)
        tree["identity"] = self._identity._asdict()
        text = json.dumps(tree, allow_nan=False).encode()
        return arrays | {_TREE: np.frombuffer(text, np.uint8)}
