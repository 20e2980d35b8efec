"""The table `[observe]` of a scene file: what a policy is shown at each control step."""

from collections.abc import Collection, Sequence
from typing import Annotated

from msgspec import Meta, field

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.tables.values import Label, NotNegative, Text, TomlTable, TrueOrFalse

POINTS_KEY = "points"
"""Beginning of the key of material points: points:64 are 64 of them."""

MOST_SHOWN_POINTS = 4096
"""Material points that can be shown at most."""

STATE_KEYS = (BLADE_NAME, "wrench", "wrench_peak", "target", "depth")
"""Quantities that can be shown, besides material points and graspers."""

_OF_PLAN = ("target", "depth")
"""Those that are about the plan of the task."""

_SMALLEST, _LARGEST = 8, 2048
"""Bounds of the width and the height of a picture [pixel]."""

LONGEST_DELAY = 1.0
"""Longest delay of a force sensor [s]: more is taken for milliseconds."""

_Pixels = Annotated[int, Meta(ge=_SMALLEST, le=_LARGEST)]
_Size = Annotated[
    tuple[_Pixels, _Pixels],
    Meta(description=f"two whole numbers from {_SMALLEST} to {_LARGEST}: [width, height]"),
]
Delay = Annotated[
    float, Meta(ge=0.0, le=LONGEST_DELAY, description=f"a time from 0 to {LONGEST_DELAY:g} s")
]


class CameraTable(TomlTable, kw_only=True, frozen=True):
    """A row of `cameras`: a picture that is drawn at each control step."""

    name: Label
    """Camera: endoscope, overview, a view of the scene, or a camera of your MJCF."""
    size: _Size = (128, 128)
    """Width and height [pixel]."""
    rgb: TrueOrFalse = True
    """Colours."""
    depth: TrueOrFalse = False
    """Distance of what each pixel shows, along the line of sight of the middle [m]."""
    segmentation: TrueOrFalse = False
    """Number of what each pixel shows: an instrument, or a part of the body."""


class SensorTable(TomlTable, kw_only=True, frozen=True):
    """`[observe.sensor]`: errors of the force sensor of the blade; none without."""

    force: NotNegative = 0.0
    """Standard deviation of each force, by noise that differs from step to step [N]."""
    torque: NotNegative = 0.0
    """Standard deviation of each torque [N m]."""
    delay: Delay = 0.0
    """Time after which the sensor shows what was [s]."""


class ObserveTable(TomlTable, kw_only=True, frozen=True):
    """`[observe]`: what a policy is shown at each control step."""

    state: (
        Annotated[
            tuple[Text, ...], Meta(description='names of quantities: ["blade", "wrench", "depth"]')
        ]
        | None
    ) = None
    """Quantities: blade, its pose and speed; wrench on it, mean of the control step, and
    wrench_peak, the largest force in it; target, the plan ahead of the tip; depth of the tip;
    points:64, so many material points of the skin; and graspers by name. Without: blade, wrench,
    the graspers, and target and depth where the task has a plan."""
    cameras: tuple[CameraTable, ...] = ()
    """Rows of cameras: [{name = "endoscope", size = [128, 128], segmentation = true}]."""
    sensor: SensorTable = field(default_factory=SensorTable)
    """Noise and delay of the force sensor."""


def check_observe(
    observe: ObserveTable | None,
    graspers: Sequence[str],
    cameras: Collection[str] | None,
    *,
    has_task: bool,
) -> None:
    """Check that the keys of `[observe]` make sense in their scene.

    Args:
        observe: The table; None: there is none.
        graspers: Names of the graspers.
        cameras: Names of all cameras; None: a model of the user's own may have more.
        has_task: Whether the scene has a task.

    Raises:
        UsageError: they do not.
    """
    if observe is None:
        return
    shown = observe.state or ()
    for key in shown:
        _check_key(key, graspers)
        if key in _OF_PLAN and not has_task:
            raise UsageError(f"[observe] state has {key}, of the plan of a task: add [task]")
    if len(set(shown)) < len(shown):
        raise UsageError(f"[observe] state names a quantity twice: {', '.join(shown)}")
    names = [row.name for row in observe.cameras]
    for i, row in enumerate(observe.cameras):
        where = f"[observe] row {i + 1} of cameras"
        if cameras is not None and row.name not in cameras:
            raise UsageError(f"{where}: {unknown('camera', row.name, cameras)}")
        if not (row.rgb or row.depth or row.segmentation):
            raise UsageError(f"{where} shows nothing; one of rgb, depth, segmentation is true")
        if row.name in names[:i]:
            raise UsageError(f"{where} is the second one of '{row.name}'; make them one")


def _check_key(key: str, graspers: Sequence[str]) -> None:
    """Refuse a quantity that there is not."""
    if key in (*STATE_KEYS, *graspers):
        return
    name, _, count = key.partition(":")
    if name != POINTS_KEY:
        known = (*STATE_KEYS, f"{POINTS_KEY}:64", *graspers)
        raise UsageError(f"[observe] state: {unknown('quantity', key, known)}")
    if not (count.isdecimal() and 1 <= int(count) <= MOST_SHOWN_POINTS):
        raise UsageError(
            f"[observe] state has '{key}'; the number of points is from 1 to {MOST_SHOWN_POINTS}, "
            f"as in {POINTS_KEY}:64"
        )


def quantities_shown(
    observe: ObserveTable, graspers: Sequence[str], *, has_plan: bool
) -> tuple[str, ...]:
    """Return the quantities that a policy is shown, in order.

    Args:
        observe: The table.
        graspers: Names of the graspers of the scene, in order.
        has_plan: Whether its task has a plan with a line on the skin.
    """
    if observe.state is not None:
        return observe.state
    return (BLADE_NAME, "wrench", *graspers, *(_OF_PLAN if has_plan else ()))
