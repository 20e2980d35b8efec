"""The struct of all arrays is made again where an owner has replaced its own."""

import numpy as np
import pytest

from tests.support import bodies, strokes
from tissue import BladeShape, Geom, Material, Tissue

MESH = bodies.jittered(3, 0)
TOP = MESH.positions.max(axis=0)
BALL = np.array([*MESH.positions.mean(axis=0)[:2], TOP[2] + 0.0101])


def is_current(model):
    """Whether the struct has the arrays that the owners have now."""
    context = model.context
    pairs = (
        (context.body, model.body),
        (context.elastic, model.elasticity.arrays),
        (context.blade, model.interaction.state),
        (context.contacts, model.contact.forces),
        (context.geoms, model.geoms.arrays),
        (context.stages, model.stages),
        (context.visits, model.visits),
        (context.attachments, model.attachments),
        (context.loose, model.loose),
        (context.damping, model.damping),
    )
    return all(one is other for one, other in pairs)


@pytest.fixture
def touched(monkeypatch):
    """Return a body on which a ball is pressed, with room for one contact at first."""
    monkeypatch.setattr("tissue.contact.geoms.geom_contact.CONTACTS_AT_FIRST", 1)
    tissue = Tissue(MESH, Material(), fixed=bodies.sides(MESH), blade=BladeShape())
    tissue.collide_with([Geom("ball", "sphere", (0.01,), 0.3)], [BALL]).move([BALL - [0, 0, 5e-4]])
    return tissue


def test_the_struct_is_current_after_each_step_of_a_cut_with_attachments(touched):
    nodes = np.flatnonzero(MESH.positions[:, 2] > TOP[2] - 1e-6)[:4]
    for i, sweep in enumerate(strokes.sweeps(strokes.THROUGH["slanted"](MESH))):
        if i % 50 == 0:
            grip = touched.attach(nodes, stiffness=20.0)
        if i % 50 == 20:
            touched.release(grip)
        touched.step(sweep, strokes.DT)
        assert is_current(touched._model)


def test_a_struct_stays_while_no_owner_replaces_arrays():
    tissue = Tissue(MESH, Material(), fixed=bodies.sides(MESH))
    tissue.step(None, strokes.DT)
    first = tissue._model.context
    for _ in range(5):
        tissue.step(None, strokes.DT)
    assert tissue._model.context is first
