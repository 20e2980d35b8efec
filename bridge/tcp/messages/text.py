"""The description of the tissue, names of scenes in it, and errors."""

import re
from collections.abc import Sequence
from typing import Annotated, Any

import msgspec
import numpy as np

from bridge.description import NamedLabel, SceneView, TissueDescription
from bridge.tcp.messages.encoding import Count, FiniteFloat, Many, Message, Part, Record
from bridge.tcp.wire import MessageError
from tissue import Material

LARGEST_ERROR = 1 << 16
"""Largest error [byte]: text for a person to read."""

LARGEST_DESCRIPTION = 1 << 19
"""Largest description [byte]: a name, a dozen numbers, the views, of some 300 bytes each, and the
names of labels, of up to 400."""

MAX_VIEWS = 256
"""Largest number of views of a scene: more than anyone searches in a list."""

MAX_LABELS = 1024
"""Largest number of labels with names that are sent: more than a person tells apart."""

LONGEST_LABEL = 100
"""Longest name of a label that is sent [characters]."""

_LONGEST_NAME = 64
_UNNAMED = "tissue"

WANTED_NAME = f"1 to {_LONGEST_NAME} letters, digits, underscores and dashes"
"""Meaning of the name of a scene, for the documentation."""

SentSceneName = Annotated[str, msgspec.Meta(pattern=rf"^[A-Za-z0-9_-]{{1,{_LONGEST_NAME}}}\Z")]
"""Name of a scene between two processes. The other side may name a folder by it: it is no path."""


def sent_scene_name(name: str) -> str:
    """Return a name as another process gets it: what may not be in one is an underscore there."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)[:_LONGEST_NAME] or _UNNAMED


def sent_labels(labels: Sequence[NamedLabel]) -> tuple[NamedLabel, ...]:
    """Return names of labels as another process gets them: short and printable."""
    return tuple(
        label._replace(name=_printable(label.name[:LONGEST_LABEL])) for label in labels[:MAX_LABELS]
    )


def _printable(text: str) -> str:
    """Return a text without control characters."""
    return "".join(letter if letter.isprintable() else "\ufffd" for letter in text)


def pack_error(message: str) -> bytes:
    """Return the reply to a request that failed: one line for a person to read, plain UTF-8."""
    return message[: LARGEST_ERROR // 4].encode(
        "utf-8", "replace"
    )  # a character has at most 4 bytes


def unpack_error(payload: bytes) -> str:
    """Return the line in an ERROR, without control characters.

    Raises:
        MessageError: the payload is not UTF-8.
    """
    try:
        text = payload.decode("utf-8")
    except UnicodeDecodeError as error:
        raise MessageError(f"an error that cannot be read: {error}") from error
    return _printable(text)


def _check_description(description: TissueDescription) -> None:
    low, high = bounds = description.bounds
    if not (np.isfinite(bounds).all() and (low <= high).all()):
        raise MessageError(
            f"the tissue's bounds are {bounds.tolist()} m; wanted finite corners, the lowest first"
        )
    if not all(view.name.isprintable() for view in description.views):
        raise MessageError("a view of the scene has a control character in its name")
    if not all(label.name.isprintable() for label in description.labels):
        raise MessageError("a label of the body has a control character in its name")


class _Material(Part):
    """A material: a map of its keys."""

    def plain(self, value: Material) -> Any:
        """Return a map of the keys."""
        return value.as_keys()

    def value(self, plain: Any, lengths: dict[str, int]) -> Material:
        """Return the material."""
        try:
            return Material.of_keys(msgspec.structs.asdict(plain))
        except ValueError as error:
            raise MessageError(str(error)) from error


_Place = tuple[FiniteFloat, FiniteFloat, FiniteFloat]
_Curve = tuple[tuple[float, float], ...]

DESCRIPTION: Message[TissueDescription] = Message(
    Record(
        TissueDescription,
        scene=SentSceneName,
        material=_Material(
            msgspec.defstruct(
                "Material",
                [
                    (name, _Curve if name == "prony" else type(value), value)
                    for name, value in Material().as_keys().items()
                ],
            )
        ),
        bounds=(2, 3),
        n_tetrahedra=Count,
        n_nodes=Count,
        n_cut_faces=Count,
        floor=FiniteFloat,
        views=Many(
            Record(
                SceneView,
                name=Annotated[str, msgspec.Meta(max_length=100)],
                eye=_Place,
                target=_Place,
                up=_Place,
                fov_degrees=Annotated[float, msgspec.Meta(gt=0.0, lt=180.0)],
            ),
            MAX_VIEWS,
        ),
        labels=Many(
            Record(
                NamedLabel, label=Count, name=Annotated[str, msgspec.Meta(max_length=LONGEST_LABEL)]
            ),
            MAX_LABELS,
        ),
    ),
    "the tissue's description",
    _check_description,
)
"""The reply to a HELLO."""
