"""Strokes of one kind, planned for a body."""

import math

from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.strokes.kinds import STROKES
from scalpel_sim.strokes.kinds.incision import DRAG_SHARE
from scalpel_sim.strokes.scene_stroke import stroke_through
from tissue import Material

PLANNED = [name for name, kind in STROKES.items() if kind.is_planned]


def plan_stroke(kind, mesh, *, material=Material(), lowest=-math.inf, **keys):
    """Return the stroke of that kind through a body; `keys` are those of its row."""
    return stroke_through(mesh, [StrokeTable(kind=kind, **keys)], material, lowest)


def plan_incision(mesh, drag=0.0, **keys):
    """Return an incision in a material in which the edge runs ahead by `drag` [m]."""
    material = Material(young_modulus=1e4, toughness=1e4 * drag / DRAG_SHARE)
    return plan_stroke("incision", mesh, material=material, **keys)
