"""Contact adds to the frequency of each node that it touches, and to no other's."""

import numpy as np
import pytest

from tests.support import bodies, strokes
from tissue import BladeShape, Material, Tissue
from tissue.elasticity.frequency.changes import return_all_mass
from tissue.elasticity.stars import tetrahedron_of_slot

MESH = bodies.jittered(4, 2, size=0.04)
LIVER = {"poisson_ratio": 0.45, "young_modulus": 3000.0, "toughness": 5.0}


def cut(law="neo_hookean", **properties):
    """Return a block that was cut, its lips in contact, and the results of the stroke."""
    material = Material(law=law, **LIVER, **properties)
    tissue = Tissue(MESH, material, fixed=bodies.sides(MESH), blade=BladeShape())
    return tissue, strokes.make(tissue, strokes.straight(MESH))


@pytest.fixture(scope="module")
def lips():
    """Return the bounds of a block whose lips touch, its masses, and the results of the cut."""
    tissue, results = cut()
    return tissue._model, results


def test_lips_that_touch_take_no_further_step(lips):
    _, results = lips
    assert max(result.n_substeps for result in results) == 2
    assert sum(result.body_contacts.n_contacts > 0 for result in results) > 300


def test_body_and_contact_together_are_below_the_limit_at_each_node(lips):
    model, _ = lips
    elastic, n = model.elasticity.arrays, model.body.n_nodes
    touching = elastic.touching[: elastic.n_touching]
    together = elastic.frequency_squared[:n] + elastic.of_contact[:n]
    assert len(touching) > 50
    assert (elastic.of_contact[touching] > 0.0).all()
    assert np.delete(elastic.of_contact[:n], touching).max() == 0.0
    assert together[touching].max() <= (1.0 + 1e-9) * elastic.allowed_touching
    assert elastic.highest_touching == pytest.approx(together[touching].max(), rel=1e-9)


def test_the_bound_of_a_tetrahedron_has_the_contact_of_its_nodes(lips):
    model, _ = lips
    elastic, body = model.elasticity.arrays, model.body
    solid, n = elastic.solid, body.n_nodes
    together = elastic.frequency_squared[:n] + elastic.of_contact[:n]
    node = elastic.touching[np.argmax(together[elastic.touching[: elastic.n_touching]])]
    slots = range(solid.first[node], solid.first[node] + solid.count[node])
    for slot in slots:
        corners = body.tetrahedra[tetrahedron_of_slot(solid, slot)]
        bound = 1.0 / float(solid.inverse_bound[solid.around[slot]])
        assert bound >= (1.0 - 1e-5) * together[corners].max()


def test_a_node_that_gives_back_mass_resists_its_contacts_as_before():
    model = cut()[0]._model
    elastic, body = model.elasticity.arrays, model.body
    n = body.n_nodes
    resistance = (elastic.of_contact * body.masses)[:n]
    masses = body.masses[:n].copy()
    elastic.scaling.allowed *= 4.0
    return_all_mass(elastic, body, elastic.solid.every)
    assert (body.masses[:n] < 0.99 * masses).any()
    np.testing.assert_allclose((elastic.of_contact * body.masses)[:n], resistance, rtol=1e-12)
