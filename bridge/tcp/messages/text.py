"""The messages of text: the description of the tissue (JSON) and an error (plain UTF-8)."""

import math
import re
from typing import Annotated

import msgspec
import numpy as np

from bridge.link import SceneView, TissueDescription
from bridge.tcp.messages.counts import check_counts
from bridge.tcp.wire import MessageError
from tissue import BladeShape, Material

LARGEST_ERROR = 1 << 16
"""Largest error [byte]: text for a person to read."""

LARGEST_DESCRIPTION = 1 << 18
"""Largest description [byte]: a name, a dozen numbers, and the views, of some 300 bytes each."""

MAX_VIEWS = 256
"""Largest number of views of a scene: more than anyone looks for in a list."""

LONGEST_NAME = 64
"""Longest name [characters]."""

WANTED_NAME = f"1 to {LONGEST_NAME} letters, digits, underscores and dashes"
"""What a name is, for messages."""

_NAME = re.compile(f"[A-Za-z0-9_-]{{1,{LONGEST_NAME}}}")

_UNNAMED = "tissue"


def is_scene_name(name: str) -> bool:
    """Return whether another process may call its scene that."""
    return _NAME.fullmatch(name) is not None


def sent_scene_name(name: str) -> str:
    """Return a name as another process gets it: what may not be in one is an underscore there."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)[:LONGEST_NAME] or _UNNAMED


_Place = tuple[float, float, float]


class _View(msgspec.Struct, forbid_unknown_fields=True):
    name: Annotated[str, msgspec.Meta(max_length=100)]
    eye: _Place
    target: _Place
    up: _Place
    fov_degrees: Annotated[float, msgspec.Meta(gt=0.0, lt=180.0)]


class _Description(msgspec.Struct, forbid_unknown_fields=True):
    scene: str
    material: Material
    bounds: tuple[tuple[float, float, float], tuple[float, float, float]]
    n_tetrahedra: int
    n_nodes: int
    blade: BladeShape | None
    floor: float | None
    views: Annotated[list[_View], msgspec.Meta(max_length=MAX_VIEWS)]


_description_decoder = msgspec.json.Decoder(_Description)


def pack_description(description: TissueDescription) -> bytes:
    """Return the reply to a HELLO."""
    low, high = description.bounds.tolist()
    return msgspec.json.encode(
        _Description(
            description.scene,
            description.material,
            (tuple(low), tuple(high)),
            description.n_tetrahedra,
            description.n_nodes,
            description.blade,
            description.floor,
            [_View(*view) for view in description.views],
        )
    )


def unpack_description(payload: bytes) -> TissueDescription:
    """Return the description in the reply to a HELLO.

    Raises:
        MessageError: a field is missing, of another type, or out of range.
    """
    try:
        found = _description_decoder.decode(payload)
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise MessageError(f"the tissue's description cannot be read: {error}") from error
    if not is_scene_name(found.scene):
        raise MessageError(f"the tissue's scene is {found.scene[:80]!r}; wanted {WANTED_NAME}")
    bounds = np.array(found.bounds)
    if not (np.isfinite(bounds).all() and (bounds[0] <= bounds[1]).all()):
        raise MessageError(
            f"the tissue's bounds are {bounds.tolist()} m; wanted finite corners, the lowest first"
        )
    check_counts(found.n_nodes, found.n_tetrahedra)
    if found.floor is not None and not math.isfinite(found.floor):
        raise MessageError(f"the floor is at {found.floor} m; wanted a finite height")
    if not all(view.name.isprintable() for view in found.views):
        raise MessageError("a view of the scene has a control character in its name")
    return TissueDescription(
        found.scene,
        found.material,
        bounds,
        found.n_tetrahedra,
        found.n_nodes,
        found.blade,
        found.floor,
        tuple(SceneView(*msgspec.structs.astuple(view)) for view in found.views),
    )


def pack_error(message: str) -> bytes:
    """Return the reply to a request that failed: one line for a person to read."""
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
    return "".join(letter if letter.isprintable() else "\ufffd" for letter in text)
