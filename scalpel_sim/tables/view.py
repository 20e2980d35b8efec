"""The table `[[view]]`: where a scene is looked at from."""

import math
from collections.abc import Sequence
from typing import Annotated

import numpy as np
from msgspec import Meta, ValidationError, convert

from bridge import LinkError, SceneView
from scalpel_sim.errors import UsageError
from scalpel_sim.tables.values import ThreeNumbers, TomlTable, check_own_name

DEFAULT_FOV = 38.0
"""Angle that a picture spans from its lower to its upper side, where a view says nothing [deg]."""

_SMALLEST_TILT = 1e-6
"""Sine of the angle between the line of sight and `up` below which a picture has no upper side."""

_Label = Annotated[
    str,
    Meta(
        pattern=r"^[^\s\x00-\x1f\x7f]([^\x00-\x1f\x7f]{0,38}[^\s\x00-\x1f\x7f])?\Z",
        description="a name of one line, of 1 to 40 characters",
    ),
]
_Angle = Annotated[
    float, Meta(gt=0.0, lt=180.0, description="an angle above 0 and below 180 degrees")
]


class ViewTable(TomlTable, kw_only=True, frozen=True):
    """`[[view]]`: a camera, which stands still in the frame of the tissue."""

    name: _Label
    """What the pages call it."""
    eye: ThreeNumbers
    """Where the camera is [m]."""
    target: ThreeNumbers
    """The point in the middle of the picture [m]."""
    up: ThreeNumbers = (0.0, 0.0, 1.0)
    """Direction that points to the upper side of the picture."""
    fov_degrees: _Angle = DEFAULT_FOV
    """Angle from the lower to the upper side of the picture."""


def check_views(views: Sequence[ViewTable]) -> None:
    """Check that each view shows something, the right way up, and that names differ.

    Raises:
        UsageError: they do not; the message says which.
    """
    for i, view in enumerate(views):
        where = f"[[view]] number {i + 1}"
        _check(view, where)
        check_own_name(view.name, [other.name for other in views[:i]], where)


def sent_views(views: Sequence[ViewTable]) -> tuple[SceneView, ...]:
    """Return the views of a scene as a server of its tissue sends them."""
    return tuple(
        SceneView(view.name, view.eye, view.target, view.up, view.fov_degrees) for view in views
    )


def received_views(views: Sequence[SceneView]) -> tuple[ViewTable, ...]:
    """Return the views that a server has sent.

    Raises:
        LinkError: one of them shows nothing, or has no name that a page can show.
    """
    try:
        tables = tuple(convert(view._asdict(), ViewTable) for view in views)
        check_views(tables)
    except (ValidationError, UsageError) as error:
        raise LinkError(f"the server sends a view that cannot be used: {error}") from error
    return tables


def _check(view: ViewTable, where: str) -> None:
    distance = math.dist(view.eye, view.target)
    if distance == 0.0:
        raise UsageError(f"{where} has its eye at its target, {list(view.eye)}; move one of them")
    length = math.hypot(*view.up)
    if not (math.isfinite(distance) and math.isfinite(length)):
        raise UsageError(f"{where} has an eye, a target or an up that is too large")
    if length == 0.0:
        raise UsageError(f"{where} up is [0, 0, 0]; it is a direction, such as [0, 0, 1]")
    sight = (np.array(view.target) - np.array(view.eye)) / distance
    if np.linalg.norm(np.cross(sight, np.array(view.up) / length)) < _SMALLEST_TILT:
        across = [0, 1, 0] if abs(sight[1]) < abs(sight[2]) else [0, 0, 1]
        raise UsageError(
            f"{where} looks along its up, {list(view.up)}; give another up, such as {across}"
        )
