"""Blocks that are cut along given planes, and their terms against plans of known geometry."""

import numpy as np

from scalpel_sim import StrokeTable
from scalpel_sim.scene.task_table import SpareTable, TaskTable
from scalpel_sim.scoring.cut_terms import CutTerms
from scalpel_sim.scoring.yardstick import Yardstick, yardstick_of
from scalpel_sim.strokes.scene_stroke import stroke_through
from tissue import CutSettings, SolverSettings, TetrahedralMesh, Tissue, block

SIZE = (0.04, 0.06, 0.04)
COARSE, FINE = (4, 6, 4), (8, 12, 8)
"""Cells of two meshes; planes at whole centimetres are planes of both."""

EVERYWHERE = CutSettings(snap=0.0, floor=0.0, guard=0.0)
"""Cuts follow a plane that is none of the mesh."""


def body(cells=COARSE, *, labels=None, cut=CutSettings(), turn=None, shift=0.0):
    """Return a body without weight. `labels`: of the middles of the tetrahedra."""
    mesh = block(cells, SIZE)
    found = np.zeros(len(mesh.tetrahedra), np.int64)
    if labels is not None:
        found = labels(mesh.positions[mesh.tetrahedra].mean(axis=1)).astype(np.int64)
    positions = mesh.positions if turn is None else mesh.positions @ turn.T
    mesh = TetrahedralMesh(positions + shift, mesh.tetrahedra, found, {1: "vessel"})
    return Tissue(mesh, gravity=(0.0, 0.0, 0.0), solver=SolverSettings(cut=cut))


def upright_cut(tissue, ends, low, *, turn=None, shift=0.0):
    """Cut along an upright plane from one point of the ground to another, down to a height."""
    start, end = (np.array(each, float) for each in ends)
    edges = np.array([[[*at, z] for z in (low, 0.05)] for at in (start, end)])
    forward = np.array([*(end - start), 0.0])
    if turn is not None:
        edges, forward = edges @ turn.T + shift, turn @ forward
    tissue.incise(edges, forward)


def yardstick(tissue, **task) -> Yardstick:
    """Return what a task of the body is compared with."""
    snapshot = tissue.snapshot()
    air = StrokeTable(
        kind="stab", points=[(9.0, 0.0, 0.0)], length=0.01, depth=0.01, forward=(0, 1, 0)
    )
    stroke = stroke_through(TetrahedralMesh(snapshot.positions, snapshot.tetrahedra), [air])
    return yardstick_of(TaskTable(**task), stroke, snapshot, tissue.label_names)


def terms(tissue, **task) -> CutTerms:
    """Return the terms of what was cut of a body."""
    found = CutTerms(yardstick(tissue, **task))
    found.take(tissue.cut_faces())
    return found


def spare(name, margin=0.0):
    """Return rows of what is to be spared."""
    return (SpareTable(label=name, margin=margin),)
