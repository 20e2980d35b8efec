"""The part of a workspace that an arm reaches: a box around where it starts."""

from collections.abc import Callable
from typing import TypeVar

import numpy as np

from scalpel_sim.arm.arm import CHOSEN_BY_SIZE
from scalpel_sim.arm.placement import AUTO, PlacementError
from scalpel_sim.strokes.stroke import Stroke
from tissue import BladeSegment, FloatArray

PlaceT = TypeVar("PlaceT")

SMALLEST_SHARE = 1.0 / 16.0
"""Share of a workspace below which an arm that does not reach it is refused: of the body and 20 mm
around it that is a few millimetres each way, in which nobody can cut."""

NEAR_ENOUGH = 1e-3
"""Distance between the side of a box and the end of the arm's reach, at most [m]."""

_CORNERS = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 1, 1), (1, 1, 1), (1, 0, 1), (0, 0, 1))
"""Corners of a box in an order in which each is next to the next: 0 is low, 1 is high."""


def reachable_part(
    workspace: FloatArray,
    middle: FloatArray,
    start: BladeSegment,
    place: Callable[[Stroke, FloatArray], PlaceT],
    reaches: Callable[[PlaceT, Stroke], bool],
) -> tuple[PlaceT, FloatArray]:
    """Return the place of an arm, and the part of a workspace that it reaches from there.

    Args:
        workspace: See `tour_of`, as the next two.
        middle: Where the middle of the instrument is at the start [m].
        start: An edge along the instrument there.
        place: Places the arm so that it reaches a tour of shares of its workspace, which are given
            too; raises `PlacementError` where it cannot.
        reaches: Whether an arm that has been placed reaches a tour.

    Raises:
        PlacementError: there is no place even for the smallest shares.
    """

    def place_for(shares: FloatArray) -> tuple[PlaceT, FloatArray]:
        box = middle + shares * (workspace - middle)
        return place(tour_of(box, middle, start), shares), box

    found, box = placed_within(place_for)
    return found, grown_within(
        box, workspace, lambda larger: reaches(found, tour_of(larger, middle, start))
    )


def tour_of(workspace: FloatArray, middle: FloatArray, start: BladeSegment) -> Stroke:
    """Return a stroke from the start to all corners of a workspace, one a second.

    Args:
        workspace: Lowest and highest place of the middle of an instrument [m], shape (2, 3).
        middle: Where that is at the start [m].
        start: An edge along the instrument at the start; it keeps its direction.
    """
    shifts = [workspace[np.array(corner), np.arange(3)] - middle for corner in _CORNERS]
    poses = [
        start._replace(tip=start.tip + shift, heel=start.heel + shift)
        for shift in (np.zeros(3), *shifts)
    ]
    return Stroke(np.arange(float(len(poses))), poses, "live hand", is_led=True)


def arm_for(preset: str, shares: FloatArray) -> str:
    """Return which arm is to reach shares of a workspace: the largest, where not all is reached.

    Args:
        preset: What was requested, one of `arm.ARMS` or `auto`.
        shares: How much of it along each axis, around the start, shape (3,).
    """
    return CHOSEN_BY_SIZE[-1] if preset == AUTO and shares.min() < 1.0 else preset


def placed_within(place: Callable[[FloatArray], PlaceT]) -> PlaceT:
    """Return what places an arm for its workspace, or for a smaller one that it reaches.

    The workspace is halved about the start until there is a place: in height first, where these
    arms reach least and an instrument needs least, then in all directions.

    Args:
        place: Places the arm so that it reaches certain shares of its workspace: see
            `arm_for`.

    Raises:
        PlacementError: there is no place even for the smallest shares.
    """
    try:
        return place(np.ones(3))
    except PlacementError:
        smallest = place(np.full(3, SMALLEST_SHARE))
    level, height = 1.0, 0.5
    while level > SMALLEST_SHARE:
        try:
            return place(np.array([level, level, height]))
        except PlacementError:
            level, height = (height, height) if level > height else (level, 0.5 * height)
    return smallest


def grown_within(
    box: FloatArray, workspace: FloatArray, reaches: Callable[[FloatArray], bool]
) -> FloatArray:
    """Return a box, each side of which is moved out as far as the arm reaches, in turn.

    Args:
        box: What it reaches [m], shape (2, 3).
        workspace: What is wanted, around it.
        reaches: Whether an arm that has been placed reaches a box.
    """
    if np.array_equal(box, workspace):
        return box
    box = box.copy()
    for side, axis in np.ndindex(2, 3):
        inner, outer = float(box[side, axis]), float(workspace[side, axis])
        box[side, axis] = outer
        if reaches(box):
            continue
        while abs(outer - inner) > NEAR_ENOUGH:
            box[side, axis] = 0.5 * (inner + outer)
            if reaches(box):
                inner = float(box[side, axis])
            else:
                outer = float(box[side, axis])
        box[side, axis] = inner
    return box
