"""The table `[act]` of a scene file: the actions of a policy that leads the instruments."""

from collections.abc import Sequence
from typing import Annotated, Literal

from msgspec import Meta

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.tables.values import Name, Positive, TomlTable, one_of

_FRAME = 1e-3
"""Length of a frame of an arm [s], of which a control step has a whole number."""

_SHORTEST, _LONGEST = _FRAME, 0.1
"""Bounds of a control step [s]: a frame, and a fifth of the period of a hand that trembles."""

_ROUNDING = 1e-6
"""Share of a frame by which a control step may miss a whole number of them: decimals of a file."""

_Step = Annotated[
    float,
    Meta(ge=_SHORTEST, le=_LONGEST, description=f"a time from {_SHORTEST} to {_LONGEST} s"),
]


class ActTable(TomlTable, kw_only=True, frozen=True):
    """`[act]`: what a policy does at each control step, and within which limits."""

    mode: Annotated[Literal["pose_delta"], one_of("pose_delta")] = "pose_delta"
    """Meaning of an action: pose_delta, how far each hand moves and turns in the control step."""
    frame: Annotated[Literal["tool", "base"], one_of("tool", "base")] = "tool"
    """Axes of motions and turns: tool, those of the instrument as it is; or base, those of the
    tissue."""
    hands: (
        Annotated[
            tuple[Name, ...], Meta(min_length=1, description='names of hands: ["blade", "left"]')
        ]
        | None
    ) = None
    """Instruments that a policy leads: blade, and names of graspers; all without. The others follow
    the scene."""
    step: _Step = 0.02
    """Control step [s]: a whole number of milliseconds."""
    speed: Positive = 0.1
    """Highest speed of a hand [m/s]: an action of 1 along an axis moves it by speed times step."""
    turn: Positive = 1.5
    """Highest rate at which a hand turns [rad/s]."""
    force: Positive | None = None
    """Force above which a hand gives way [N]: none does without."""
    arm: Annotated[Literal["kinematic", "full"], one_of("kinematic", "full")] = "kinematic"
    """Arms that hold the instruments: kinematic, none, they are where the hand leads them, several
    times faster; or full, those of the scene, frame by frame."""


def check_act(act: ActTable | None, graspers: Sequence[str]) -> None:
    """Check that the keys of `[act]` make sense in their scene.

    Args:
        act: The table; None: there is none.
        graspers: Names of the graspers.

    Raises:
        UsageError: they do not.
    """
    if act is None:
        return
    hands = (BLADE_NAME, *graspers)
    for name in act.hands or ():
        if name not in hands:
            raise UsageError(f"[act] hands: {unknown('hand', name, hands)}")
    if act.hands is not None and len(set(act.hands)) < len(act.hands):
        raise UsageError(f"[act] hands names one twice: {', '.join(act.hands)}")
    frames = act.step / _FRAME
    if abs(frames - round(frames)) > _ROUNDING:
        raise UsageError(
            f"[act] step is {act.step:g} s; it is a whole number of milliseconds, such as "
            f"{round(frames) * _FRAME:g}"
        )


def hands_led(act: ActTable, graspers: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the hands that a policy leads: the blade first, graspers in turn.

    Args:
        act: The table.
        graspers: Names of the graspers of the scene, in order.
    """
    hands = (BLADE_NAME, *graspers)
    return tuple(name for name in hands if act.hands is None or name in act.hands)
