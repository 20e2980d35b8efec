"""From the rows `[[stroke]]` of a scene to the path of its blade."""

import math
from collections.abc import Sequence

from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.strokes.guard import Guard
from scalpel_sim.strokes.kind import DEFAULT_PATIENCE, LyingBody, StrokeTable, check_positive
from scalpel_sim.strokes.kinds import STROKES
from scalpel_sim.strokes.sequence import in_turn
from scalpel_sim.strokes.stroke import Stroke
from scalpel_sim.tables.problems import check_keys
from tissue import FloatArray, Material, TetrahedralMesh

FASTEST_STROKE = 1.0
"""Highest speed of a stroke [m/s]: no surgeon cuts as fast."""


def stroke_through(
    mesh: TetrahedralMesh,
    strokes: Sequence[StrokeTable],
    material: Material = Material(),
    lowest: float = -math.inf,
    rest: FloatArray | None = None,
) -> Stroke:
    """Return the path of the blade that does the strokes of a scene in turn.

    Args:
        mesh: The body as it lies before the first, tissue frame [m].
        strokes: Rows of the scene, which `check_strokes` has passed.
        material: Material of the body.
        lowest: Height below which no planned stroke leads the edge [m]; see `LyingBody`.
        rest: Positions of its nodes at rest [m]; None: it lies at rest.

    Raises:
        StrokeError: a speed or a depth is not positive, no blade can follow it, or the body has no
            section where it is planned.
    """
    body = LyingBody(mesh, material, lowest, rest)
    for row in strokes:
        check_positive("speed", row.speed, "m/s")
        check_positive("depth", row.depth, "m")
    paths = [STROKES[row.kind].plan(row, body) for row in strokes]
    if any(
        row.force_limit or row.until or path.course
        for row, path in zip(strokes, paths, strict=True)
    ):
        for row, path in zip(strokes, paths, strict=True):
            path.guards = (_guard(row, path),)
    return in_turn(paths, [(row.wait, row.pause) for row in strokes], mesh)


def _guard(row: StrokeTable, path: Stroke) -> Guard:
    """Return what may end the stroke of a row otherwise than planned."""
    return Guard(
        0.0,
        path.duration,
        force_limit=math.inf if row.force_limit is None else row.force_limit,
        at_limit=row.at_limit or "stop",
        patience=DEFAULT_PATIENCE if row.patience is None else row.patience,
        is_until_through=row.until is not None,
        course=path.course,
    )


def cuts_somewhere(strokes: Sequence[StrokeTable]) -> bool:
    """Return whether one of the strokes is to cut."""
    return any(STROKES[row.kind].cuts for row in strokes)


def meets_somewhere(strokes: Sequence[StrokeTable]) -> bool:
    """Return whether the blade is to touch the body in one of the strokes."""
    return any(STROKES[row.kind].meets for row in strokes)


def check_strokes(strokes: Sequence[StrokeTable]) -> None:
    """Check that each stroke exists, and has what its kind needs.

    Raises:
        UsageError: there is none, no such kind, a key belongs to another, or numbers make no sense.
    """
    if not strokes:
        raise UsageError("the scene has no stroke; give at least one [[stroke]]")
    keys = {name: kind.keys for name, kind in STROKES.items()}
    for i, row in enumerate(strokes):
        where = f"[[stroke]] number {i + 1}"
        if row.kind not in STROKES:
            raise unknown("stroke", row.kind, STROKES)
        check_keys(row, where, "kind", keys)
        if row.speed is not None and row.speed > FASTEST_STROKE:
            raise UsageError(
                f"{where} speed is {row.speed} m/s; it must be above 0 and at most "
                f"{FASTEST_STROKE:g}"
            )
        if (row.saw_amplitude is None) != (row.saw_frequency is None):
            raise UsageError(
                f"{where} has one of saw_amplitude and saw_frequency; give both or none"
            )
        _check_limit(row, where)
        problem = STROKES[row.kind].problem(row)
        if problem is not None:
            raise UsageError(f'{where} of kind "{row.kind}" {problem}')


def _check_limit(row: StrokeTable, where: str) -> None:
    """Check that keys of a limit have one.

    Raises:
        UsageError: they do not.
    """
    if row.at_limit is not None and row.force_limit is None:
        raise UsageError(f"{where} has at_limit and no force_limit; give one, or omit it")
    if row.patience is not None and row.at_limit != "wait":
        raise UsageError(f'{where} has patience; it is for at_limit = "wait"')
    if row.at_most is not None and row.until is None:
        raise UsageError(f'{where} has at_most; it is for until = "through"')
