"""The table `[task]` of a scene file: the task, and how success is judged."""

from collections.abc import Sequence
from typing import Annotated, Literal

from msgspec import Meta, field

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.values import (
    FileName,
    Finite,
    Label,
    Name,
    NotNegative,
    Positive,
    Share,
    ThreeNumbers,
    TomlTable,
    TrueOrFalse,
    one_of,
)

TASK_KINDS = ("incise", "retract", "excise", "dissect", "biopsy", "expose", "custom")
"""Kinds of tasks."""

DOWN = (0.0, 0.0, -1.0)
"""Direction of depth where a task gives none."""

DEFAULT_TOLERANCE = 1e-3
"""Distance from the plan that counts as on it where a task gives none [m]."""

_NEEDS_TARGET = ("retract", "excise", "biopsy", "expose")
"""Kinds that are about one part of the body."""

_Kind = Annotated[
    Literal["incise", "retract", "excise", "dissect", "biopsy", "expose", "custom"],
    one_of(*TASK_KINDS),
]
_Point = Annotated[tuple[Finite, ...], Meta(min_length=2, max_length=3)]
_Line = Annotated[
    list[_Point],
    Meta(min_length=2, description="two points or more: [[x, y], ...] or [[x, y, z], ...]"),
]


class SpareTable(TomlTable, kw_only=True, frozen=True):
    """A row of `spare`: a part of the body that is to stay whole."""

    label: Label
    """Name of the part."""
    margin: NotNegative = 0.0
    """Distance from it that no cut may come below [m]."""


class LimitTable(TomlTable, kw_only=True, frozen=True):
    """A row of `limits`: a strain of the tissue, or a force of an instrument."""

    label: Label | None = None
    """Part of the body of which it is the strain; all of it without."""
    strain: Positive | None = None
    """Largest principal strain that harms nothing."""
    instrument: Name | None = None
    """Instrument whose force it is: blade, or the name of a grasper."""
    force: Positive | None = None
    """Force up to which nothing counts as excess [N]."""


class SuccessTable(TomlTable, kw_only=True, frozen=True):
    """`[task.success]`: conditions that all hold at the end. One that is not given is not asked."""

    covered: Share | None = None
    """Least share of the plan that is cut."""
    off_plan: NotNegative | None = None
    """Greatest area that is cut off the plan [m2]."""
    path_error: NotNegative | None = None
    """Greatest root mean square of the distance of the cut from the plan [m]."""
    depth_error: NotNegative | None = None
    """Greatest mean error of depth [m]."""
    spared: TrueOrFalse | None = None
    """true: what is to be spared is whole, and no cut is within its margin."""
    force: Positive | None = None
    """Greatest force of any instrument [N]."""
    strain_above: NotNegative | None = None
    """Greatest volume that was stretched beyond its limit [m3]."""
    held: Share | None = None
    """Least share of the cut that was made while every grasper held tissue."""
    removed: Share | None = None
    """Least share of the target that is cut out."""
    healthy: NotNegative | None = None
    """Greatest volume of other tissue that is cut out with it [m3]."""
    exposed: Share | None = None
    """Least share of the target that the camera sees."""


class RewardTable(TomlTable, kw_only=True, frozen=True):
    """`[task.reward]`: weights of the terms.

    The reward of a control step is the increase of their weighted sum: no way there and back pays.
    """

    covered: Finite = 0.0
    """Weight of the share of the plan that is cut."""
    off_plan: Finite = 0.0
    """Weight of the area that is cut off the plan [1/m2]."""
    path_error: Finite = 0.0
    """Weight of the root mean square of the distance of the cut from the plan [1/m]."""
    depth_error: Finite = 0.0
    """Weight of the mean error of depth [1/m]."""
    spared_area: Finite = 0.0
    """Weight of the area that is cut in what is to be spared [1/m2]."""
    strain_above: Finite = 0.0
    """Weight of the volume that was stretched beyond its limit [1/m3]."""
    force_above: Finite = 0.0
    """Weight of the greatest force beyond its limit [1/N]."""
    impulse: Finite = 0.0
    """Weight of the integral of the forces over time [1/(N s)]."""
    removed: Finite = 0.0
    """Weight of the share of the target that is cut out."""
    healthy: Finite = 0.0
    """Weight of the volume of other tissue that is cut out with it [1/m3]."""
    exposed: Finite = 0.0
    """Weight of the share of the target that a camera sees."""
    work: Finite = 0.0
    """Weight of the work of the blade [1/J]."""
    time: Finite = 0.0
    """Weight of the time [1/s]."""
    approach: Finite = 0.0
    """Weight of the distance from the tip of the blade to the place of the plan that is cut next
    [1/m]: the bottom of the cut below the first place of a line that is not cut yet, and without a
    line the nearest place. It guides, and is no term of the score."""
    success: Finite = 0.0
    """Worth of success, once."""

    def weights(self) -> dict[str, float]:
        """Return the weight of each term that has one, by its name."""
        given = {name: getattr(self, name) for name in self.__struct_fields__}
        return {name: weight for name, weight in given.items() if weight and name != "success"}


class TaskTable(TomlTable, kw_only=True, frozen=True):
    """`[task]`: the task that a run of the scene is scored by."""

    kind: _Kind = "incise"
    """Kind of the task: incise, retract, excise, dissect, biopsy, expose or custom. It names the
    task; what is measured does not depend on it."""
    line: _Line | None = None
    """Line of the cut on the skin [m]: points [x, y], or [x, y, z] near it, which are moved onto
    the skin along the depth. Without line and surface the plan is what the strokes are to cut."""
    surface: FileName | None = None
    """STL file of the surface of the cut, in the body at rest, in place of a line [m]; or the
    `plan.npz` of a run that a hand led."""
    depth: Positive | None = None
    """Depth of the cut below a line [m]."""
    into: ThreeNumbers | None = None
    """Direction in which depth is measured; [0, 0, -1] without, and for strokes into the skin that
    they enter."""
    tolerance: Positive = DEFAULT_TOLERANCE
    """Distance from the plan that counts as on it [m]."""
    marked: TrueOrFalse = False
    """Whether the line of the plan is on the skin, drawn by a pen: cameras see it."""
    target: Label | None = None
    """Part of the body that is cut out, or laid bare."""
    camera: Label | None = None
    """Camera to which the target counts as exposed: a view of the scene, or a camera of your MJCF.
    Nobody looks without."""
    spare: tuple[SpareTable, ...] = ()
    """Rows of what is to be left whole: [{label = "vessel", margin = 0.002}]."""
    limits: tuple[LimitTable, ...] = ()
    """Rows of limits: [{label = "fat", strain = 0.5}, {instrument = "left", force = 3.0}]."""
    seconds: Positive | None = None
    """Time within which it is to be done [s]; any without."""
    success: SuccessTable = field(default_factory=SuccessTable)
    """Conditions of success."""
    reward: RewardTable = field(default_factory=RewardTable)
    """Weights of the terms, for a policy that learns."""


def check_task(task: TaskTable | None, graspers: Sequence[str]) -> None:
    """Check that the keys of a task make sense together.

    Args:
        task: The table; None: there is none.
        graspers: Names of the graspers.

    Raises:
        UsageError: they do not.
    """
    if task is None:
        return
    if task.line is not None and task.surface is not None:
        raise UsageError("[task] has line and surface; one of them is the plan")
    if (task.line is None) != (task.depth is None):
        given, missing = ("depth", "line") if task.line is None else ("line", "depth")
        raise UsageError(f"[task] has {given} and no {missing}; a cut along a line has both")
    if task.into is not None and not any(task.into):
        raise UsageError("[task] into is [0, 0, 0]; it is the direction of depth")
    if task.target is None and task.kind in _NEEDS_TARGET:
        raise UsageError(f'[task] of kind "{task.kind}" has no target: the name of a label')
    for key in ("removed", "healthy", "exposed"):
        if task.target is None and getattr(task.success, key) is not None:
            raise UsageError(f"[task] success has {key} and no target is given: a label's name")
    if task.target is None and task.camera is not None:
        raise UsageError(
            "[task] has a camera and no target: the name of the label that it is to see"
        )
    if task.success.spared and not task.spare:
        raise UsageError("[task] success has spared, and spare has no rows")
    if task.success.strain_above is not None and not any(each.strain for each in task.limits):
        raise UsageError("[task] success has strain_above, and no row of limits has a strain")
    if task.success.held is not None and not graspers:
        raise UsageError(
            "[task] success has held, and the scene has no [[grasper]] that could hold"
        )
    instruments = ("blade", *graspers)
    for i, row in enumerate(task.limits):
        _check_limit(row, f"[task] row {i + 1} of limits", instruments)


def _check_limit(row: LimitTable, where: str, instruments: Sequence[str]) -> None:
    """Refuse a limit of nothing, or of two things."""
    if (row.strain is None) == (row.force is None):
        what = "no strain or force" if row.force is None else "a strain and a force"
        raise UsageError(f"{where} has {what}; give one of them")
    if row.force is None and row.instrument is not None:
        raise UsageError(f"{where} has an instrument and a strain; strain is of a label")
    if row.force is not None and row.label is not None:
        raise UsageError(f"{where} has a label and a force; force is of an instrument")
    if row.force is not None and row.instrument not in instruments:
        given = "no instrument" if row.instrument is None else f"instrument '{row.instrument}'"
        raise UsageError(f"{where} has a force and {given}; it is of {' or '.join(instruments)}")
