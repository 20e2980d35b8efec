"""From the strokes that a scene asks for to the path of its blade."""

import math
from collections.abc import Sequence

from scalpel_sim.scene.strokes import DEFAULT_SPEED, PLANNED_STROKES, StrokeTable
from scalpel_sim.strokes.drawn import drawn_stroke
from scalpel_sim.strokes.incision import INSERTED_AT, WITHDRAWN_AT
from scalpel_sim.strokes.planning import plan_stroke
from scalpel_sim.strokes.sequence import in_turn
from scalpel_sim.strokes.stroke import Stroke
from tissue import Material, TetrahedralMesh


def stroke_through(
    mesh: TetrahedralMesh,
    strokes: Sequence[StrokeTable],
    material: Material,
    lowest: float = -math.inf,
) -> Stroke:
    """Return the path of the blade that does the strokes of a scene in turn.

    Args:
        mesh: The body as it lies before the first, tissue frame [m].
        strokes: What the scene asks for.
        material: What the body is made of.
        lowest: Height below which no planned stroke leads the edge [m]; see `plan_stroke`.

    Raises:
        UsageError: there is no such stroke.
        StrokeError: no blade can follow it, or the body has no section where it is planned.
    """
    paths = [_path(mesh, table, material, lowest) for table in strokes]
    rests = [(table.wait, table.pause) for table in strokes]
    return in_turn(paths, rests, mesh)


def _path(mesh: TetrahedralMesh, table: StrokeTable, material: Material, lowest: float) -> Stroke:
    """Return the path of one stroke."""
    speed = DEFAULT_SPEED if table.speed is None else table.speed
    if table.kind in PLANNED_STROKES:
        return plan_stroke(
            table.kind,
            mesh,
            speed=speed,
            material=material,
            depth=table.depth,
            along=table.along or (INSERTED_AT, WITHDRAWN_AT),
            lowest=lowest,
        )
    return drawn_stroke(table, speed)
