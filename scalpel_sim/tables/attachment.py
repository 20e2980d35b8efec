"""The table `[[attachment]]`: what holds tissue to the world, pulls on it, or ties it."""

import math
from itertools import pairwise

from scalpel_sim.errors import UsageError
from scalpel_sim.tables.values import (
    NotNegative,
    Positive,
    Region,
    RowsOfThree,
    ThreeNumbers,
    Times,
    TomlTable,
)

_OF_LIGAMENT = ("area", "toughness")
"""Keys that a ligament has, which has a `to`, and no other attachment."""


class AttachmentTable(TomlTable, kw_only=True, frozen=True):
    """`[[attachment]]`: springs from the nodes of a region to a frame; with `to`, a ligament."""

    where: Region
    """Which nodes it holds, in the body at rest."""
    stiffness: Positive
    """Of all springs together [N/m]."""
    damping: NotNegative = 0.0
    """Of all dampers together [N s/m]."""
    rest_length: NotNegative | None = None
    """Length up to which each is slack [m]; None: 0, and of a ligament its length at first."""
    breaks_at: Positive | None = None
    """Force at which it lets go [N]."""
    to: ThreeNumbers | None = None
    """Where the strands of a ligament end [m]."""
    area: Positive | None = None
    """Their cross-section, of all together [m2]."""
    toughness: Positive | None = None
    """Energy of cutting them [J/m2]."""
    displacements: RowsOfThree | None = None
    """How far the frame is led from where it is at first, in turn [m]."""
    times: Times | None = None
    """When it is there [s]."""
    speed: Positive | None = None
    """How fast it goes there [m/s], in place of times."""
    release_at: NotNegative | None = None
    """When it lets go [s]."""


def check_attachment(table: AttachmentTable, where: str) -> None:
    """Check that the keys of an attachment make sense together.

    Args:
        table: The table.
        where: Its name as a file writes it.

    Raises:
        UsageError: they do not.
    """
    for key in _OF_LIGAMENT:
        if (getattr(table, key) is None) != (table.to is None):
            given, missing = (key, "to") if table.to is None else ("to", key)
            raise UsageError(
                f"{where} has {given} and no {missing}; a ligament, which the blade can cut, has "
                "to, area and toughness"
            )
    if table.displacements is None:
        for key in ("times", "speed"):
            if getattr(table, key) is not None:
                raise UsageError(f"{where} has {key} and no displacements; give them too")
        return
    if (table.times is None) == (table.speed is None):
        raise UsageError(f"{where} has displacements; give either times or a speed with them")
    if table.times is None:
        if any(here == there for here, there in pairwise([(0.0, 0.0, 0.0), *table.displacements])):
            raise UsageError(
                f"{where} has two displacements in turn that are equal, which takes no time at a "
                "speed; give times"
            )
        return
    if len(table.times) != len(table.displacements):
        raise UsageError(
            f"{where} has {len(table.times)} times for {len(table.displacements)} displacements; "
            "give one for each"
        )
    if not all(here < there for here, there in pairwise([0.0, *table.times])):
        raise UsageError(f"{where} has times {table.times}; they begin above 0 and increase")


def times_of(table: AttachmentTable) -> list[float]:
    """Return when the frame of an attachment is at each of its displacements [s]."""
    if table.displacements is None:
        return []
    if table.speed is None:
        assert table.times is not None
        return table.times
    found, seconds = [], 0.0
    for here, there in pairwise([(0.0, 0.0, 0.0), *table.displacements]):
        seconds += math.dist(here, there) / table.speed
        found.append(seconds)
    return found
