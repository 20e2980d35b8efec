"""The rows `[[vary]]` of a scene file: what differs from episode to episode."""

import math
from collections.abc import Sequence
from typing import Annotated, Literal

import numpy as np
from msgspec import Meta

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.scene.observe_table import LONGEST_DELAY
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.tables.values import Finite, Label, Name, TomlTable, TwoLabels, one_of

OF_MATERIAL = (
    "material.young_modulus",
    "material.density",
    "material.toughness",
    "material.stiffening",
    "material.retardation_time",
    "material.viscous_damping",
    "material.friction",
    "material.blade_friction",
    "material.blade_viscosity",
)
"""Factors of quantities of a material."""

OF_LAYER = "interface.toughness"
"""Factor of the toughness of a layer between two parts."""

OF_LINE = ("task.line.along", "task.line.across", "task.line.turn")
"""Motions of the line of a task on the skin."""

OF_START = ("start.x", "start.y", "start.z")
"""Displacements of a hand at the start."""

OF_SENSOR = ("sensor.force", "sensor.torque", "sensor.delay")
"""Errors of the force sensor, in place of those of `[observe]`."""

OF_CAMERA = ("camera.x", "camera.y", "camera.z")
"""Displacements of the eye of a camera, which goes on looking at the same point."""

OF_LIGHT = "light.brightness"
"""Factor of all lamps of images."""

OF_COLOUR = ("colour.red", "colour.green", "colour.blue")
"""Factors of the light that the body reflects."""

OF_LOOK = (*OF_CAMERA, OF_LIGHT, *OF_COLOUR)
"""Quantities that only images show."""

VARIED = (*OF_MATERIAL, OF_LAYER, *OF_LINE, *OF_START, *OF_SENSOR, *OF_LOOK)
"""All that can differ."""

LEAST_FACTOR, MOST_FACTOR = 0.1, 10.0
"""Bounds of factors: beyond them it is another tissue, and with ten times the stiffness, or a tenth
of the density, a second takes three times as many steps."""

OWNERS = {
    "label": (*OF_MATERIAL, *OF_COLOUR),
    "between": (OF_LAYER,),
    "hand": OF_START,
    "camera": OF_CAMERA,
}
"""Keys that say of what a quantity is, and the quantities that have them."""

MOST_TURN = 180.0
"""Largest turn of a line [degree]."""

MOST_WAY = 1.0
"""Largest displacement of a line or a hand [m]: more is taken for millimetres."""


class VaryTable(TomlTable, kw_only=True, frozen=True):
    """`[[vary]]`: a number that is drawn for each episode."""

    what: Annotated[
        Literal[
            "material.young_modulus",
            "material.density",
            "material.toughness",
            "material.stiffening",
            "material.retardation_time",
            "material.viscous_damping",
            "material.friction",
            "material.blade_friction",
            "material.blade_viscosity",
            "interface.toughness",
            "task.line.along",
            "task.line.across",
            "task.line.turn",
            "start.x",
            "start.y",
            "start.z",
            "sensor.force",
            "sensor.torque",
            "sensor.delay",
            "camera.x",
            "camera.y",
            "camera.z",
            "light.brightness",
            "colour.red",
            "colour.green",
            "colour.blue",
        ],
        one_of(*VARIED),
    ]
    """Quantity that varies, [one of these](#what-varies)."""
    range: Annotated[tuple[Finite, Finite], Meta(description="two numbers: [lowest, highest]")]
    """Lowest and highest number: a factor, or a value in the unit of the quantity."""
    distribution: Annotated[Literal["uniform", "log_uniform"], one_of("uniform", "log_uniform")] = (
        "uniform"
    )
    """Distribution between them: uniform; or log_uniform, as often by half as by double."""
    label: Label | None = None
    """Part of the body of whose material or colour it is a factor; all of it without."""
    between: TwoLabels | None = None
    """Names of the two parts between which the layer is."""
    hand: Name | None = None
    """Hand that starts elsewhere, blade or the name of a grasper; the blade without."""
    camera: Label | None = None
    """Camera of `[observe]` that is elsewhere; all of them without."""

    @property
    def name(self) -> str:
        """Name of its number in a draw, such as `material.toughness:fat` or `start.x:left`."""
        own = [self.label, None if self.hand == BLADE_NAME else self.hand, self.camera]
        of = "+".join([*filter(None, own), *sorted(self.between or ())])
        return f"{self.what}:{of}" if of else self.what

    def drawn(self, rng: np.random.Generator) -> float:
        """Return a number of the range, of one draw of the generator."""
        low, high = self.range
        share = float(rng.random())
        if self.distribution == "log_uniform":
            return min(low * math.exp(share * math.log(high / low)), high)
        return min(low + (high - low) * share, high)


def check_vary(
    rows: Sequence[VaryTable],
    hands: Sequence[str],
    layers: Sequence[tuple[str, str]],
    cameras: Sequence[str],
    task: TaskTable | None,
) -> None:
    """Check that each row makes sense in its scene.

    Args:
        rows: The rows.
        hands: Names of the hands that a policy leads.
        layers: Names of the two parts between which each layer is.
        cameras: Names of the cameras of images.
        task: The task; None: there is none.

    Raises:
        UsageError: one does not; the message says which.
    """
    for i, row in enumerate(rows):
        where = f"[[vary]] number {i + 1}, of {row.what},"
        _check_range(row, where)
        _check_owner(row, where, hands, layers)
        if row.what in OF_LOOK and not cameras:
            raise UsageError(f"{where} is seen in images alone: add `cameras` to [observe]")
        if row.what in OF_CAMERA and row.camera is not None and row.camera not in cameras:
            asked = unknown("camera of [observe]", row.camera, cameras)
            raise UsageError(f"{where} camera: {asked}")
        if row.what in OF_LINE and (task is None or task.line is None):
            raise UsageError(f"{where} moves the line of a task: add `line` to [task]")
        if any(row.name == other.name for other in rows[:i]):
            raise UsageError(f"{where} is the second one of {row.name}; make them one")


def _check_range(row: VaryTable, where: str) -> None:
    """Refuse a range that a quantity cannot have."""
    low, high = row.range
    if low > high:
        raise UsageError(f"{where} has range [{low:g}, {high:g}]; the lowest number comes first")
    if row.distribution == "log_uniform" and low <= 0.0:
        raise UsageError(f"{where} is log_uniform, and its range begins at {low:g}; above 0 it may")
    least, most, unit = _bounds(row.what)
    if low < least or high > most:
        bounds = f"from {least:g} to {most:g}" if most < math.inf else f"at least {least:g}"
        raise UsageError(f"{where} has range [{low:g}, {high:g}]; {unit} is {bounds}")


def _bounds(what: str) -> tuple[float, float, str]:
    """Return the lowest and the highest number that a quantity may have, and what it is."""
    if what in (*OF_MATERIAL, OF_LAYER, OF_LIGHT, *OF_COLOUR):
        return LEAST_FACTOR, MOST_FACTOR, "a factor"
    if what == "task.line.turn":
        return -MOST_TURN, MOST_TURN, "a turn [degree]"
    if what in (*OF_LINE, *OF_START, *OF_CAMERA):
        return -MOST_WAY, MOST_WAY, "a displacement [m]"
    if what == "sensor.delay":
        return 0.0, LONGEST_DELAY, "a delay [s]"
    return 0.0, math.inf, "a standard deviation"


def _check_owner(
    row: VaryTable, where: str, hands: Sequence[str], layers: Sequence[tuple[str, str]]
) -> None:
    """Refuse a part, a layer or a hand that is not there, or that another quantity has."""
    given = {key: getattr(row, key) for key in OWNERS}
    own = next((key for key, quantities in OWNERS.items() if row.what in quantities), None)
    for key, value in given.items():
        if value is not None and key != own:
            raise UsageError(f"{where} has the key {key}, which belongs to others; omit it")
    if row.what == OF_LAYER:
        pairs = [sorted(layer) for layer in layers]
        if row.between is None:
            raise UsageError(f'{where} has no between: the two parts, as in ["liver", "fat"]')
        if sorted(row.between) not in pairs:
            known = "; ".join(" and ".join(pair) for pair in pairs) or "none"
            asked = " and ".join(row.between)
            raise UsageError(f"{where} is of no [[interface]]: {asked}. Those that are: {known}")
    if row.what in OF_START and (row.hand or BLADE_NAME) not in hands:
        raise UsageError(
            f"{where} hand: {unknown('hand of a policy', row.hand or BLADE_NAME, hands)}"
        )
