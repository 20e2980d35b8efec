"""Rest shapes and node rows of a solid, built and updated after splits."""

import numpy as np
import pytest

from tests.support import bodies, naive, naive_solid
from tests.tissue.cutting.test_stellar_subdivision import split_all
from tests.tissue.kernels_of import cut_of, springs_of
from tests.tissue.solids import LAWS, built, law_of, moved, solid_of
from tissue import block
from tissue.core.simd import WIDTH
from tissue.elasticity.finite_elements import VOLUME, grown_solid, no_solid, shape_place
from tissue.elasticity.frequency.at_rest import bound_solid_frequencies
from tissue.elasticity.rest_shapes import build_tetrahedra
from tissue.elasticity.stars import (
    STAR_POOL_MARGIN,
    build_stars,
    corner_of_slot,
    room_for_stars,
    tetrahedron_of_slot,
)
from tissue.laws.energy_density import neo_hookean, volume_term
from tissue.mesh.changes import clear_changes, touched_nodes
from tissue.mesh.star import LARGEST_STAR, no_visits

pytestmark = pytest.mark.kernel

MESHES = {"grid": block((2, 1, 1), (0.2, 0.1, 0.1)), "jittered": bodies.jittered(2, 3)}


@pytest.fixture(params=MESHES)
def mesh(request):
    return MESHES[request.param]


def corners(solid, node):
    """Return the corners of tetrahedra at a node, as (tetrahedron, corner), in order."""
    first = int(solid.first[node])
    slots = range(first, first + int(solid.count[node]))
    return [(tetrahedron_of_slot(solid, slot), corner_of_slot(solid, slot)) for slot in slots]


def test_a_row_lists_each_tetrahedron_around_the_node_in_order(mesh):
    solid = solid_of(mesh, law_of(0.45)).solid
    for node in range(len(mesh.positions)):
        around = corners(solid, node)
        assert [t for t, _ in around] == sorted(naive.star(mesh.tetrahedra, node))
        assert all(mesh.tetrahedra[t, k] == node for t, k in around)


def test_a_row_is_padded_with_slots_that_are_always_zero(mesh):
    body = solid_of(mesh, law_of(0.45))
    body.energy(moved(mesh))
    assert np.abs(body.forces(moved(mesh))).max() > 0.0
    solid = body.solid
    for node in range(len(mesh.positions)):
        end = int(solid.first[node] + solid.count[node])
        beyond = slice(end, end + -int(solid.count[node]) % WIDTH)
        assert (solid.dilated[solid.around[beyond]] == 0.0).all()
        assert (solid.forces[solid.corner[beyond]] == 0.0).all()


def test_node_volumes_are_a_quarter_of_the_rest_volumes_around_the_node(mesh):
    solid = solid_of(mesh, law_of(0.45)).solid
    volumes = naive_solid.volumes(mesh)
    for t, volume in enumerate(volumes):
        assert solid.shape[shape_place(solid, t, VOLUME)] == pytest.approx(volume, rel=1e-12)
    expected = naive_solid.around_nodes(mesh, volumes)
    np.testing.assert_allclose(solid.node_volume[: len(expected)], expected, rtol=1e-12)


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_rows_updated_where_a_cut_changed_the_mesh_are_those_built_from_scratch(law):
    """The forces have the same bits, and the frequency bound stays close."""
    cut = cut_of(bodies.jittered(3, 1, size=1.0))
    springs_of(cut.body)
    updated = built(cut.body, law)
    visits, around = cut.visits, np.zeros(LARGEST_STAR, dtype=np.int64)
    nodes = np.zeros(len(cut.body.rest), dtype=np.int64)
    random = np.random.default_rng(5)
    for _ in range(20):
        clear_changes(cut.change)
        split_all(cut, [(int(random.integers(1000)), bool(random.integers(2)), 0.4, 0.5)])
        springs_of(cut.body)
        n = touched_nodes(cut.body, cut.change, visits, nodes)
        build_tetrahedra(updated.solid, cut.body, cut.change.dirty, cut.change.n_dirty)
        assert build_stars(updated.solid, cut.body, visits, nodes, n, around) == n
        assert bound_solid_frequencies(updated.solid, cut.body, visits, nodes, n) > n
    from_scratch = built(cut.body, law)
    for node in range(cut.body.n_nodes):
        assert corners(updated.solid, node) == corners(from_scratch.solid, node)
    x = cut.body.rest[: cut.body.n_nodes]
    x = x + 0.01 * np.random.default_rng(2).normal(size=x.shape)
    np.testing.assert_array_equal(updated.forces(x), from_scratch.forces(x))
    assert updated.energy(x) == from_scratch.energy(x)
    assert updated.frequency() == pytest.approx(from_scratch.frequency(), rel=0.2)


def test_too_little_capacity_for_a_row_is_reported_and_nothing_is_lost():
    complete = solid_of(MESHES["grid"], law_of(0.45))
    body, n = complete.body, complete.body.n_nodes
    room = (n, body.n_tetrahedra)
    visits, around = no_visits(*room), np.zeros(LARGEST_STAR, dtype=np.int64)
    too_small = no_solid(law_of(0.45), *room, STAR_POOL_MARGIN + 40)
    build_tetrahedra(too_small, body, too_small.every, room[1])
    done = build_stars(too_small, body, visits, too_small.every, n, around)
    assert 0 < done < n
    larger = grown_solid(too_small, *room, room_for_stars(*room))
    assert build_stars(larger, body, visits, larger.every[done:], n - done, around) == n - done
    for node in range(n):
        assert corners(larger, node) == corners(complete.solid, node)


def test_forces_are_the_same_after_the_arrays_have_grown(mesh):
    body = solid_of(mesh, law_of(0.45))
    x = moved(mesh)
    before = body.forces(x)
    room = (3 * len(mesh.positions), 5 * len(mesh.tetrahedra))
    larger = grown_solid(body.solid, *room, room_for_stars(*room))
    np.testing.assert_array_equal(body._replace(solid=larger).forces(x), before)


def test_the_law_has_the_given_moduli_at_small_strain():
    law = neo_hookean(3e3, 20e3)
    assert 0.75 * law.mu == pytest.approx(3e3)
    assert law.lam_of_nodes - 5.0 / 6.0 * 3e3 == pytest.approx(20e3)
    assert law.a == pytest.approx(1.0 + 0.75 * law.mu / law.lam_of_nodes)
    assert (volume_term(5e3).mu, volume_term(5e3).a) == (0.0, 1.0)
