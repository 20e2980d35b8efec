"""Edge anchors: where they are set, when they slip, and that action equals reaction."""

import numpy as np
import pytest

from tests.tissue.kernels_of import elastic_of, line_blade, springs_of
from tissue import Material, TetrahedralMesh, block
from tissue.blade.edge import Edge, motion_at, pose_at
from tissue.blade.edge_anchors import (
    ANCHORED,
    FREE,
    LEFT,
    RETRACTED,
    anchor_stiffness,
    anchored_length,
    anchors_energy,
    is_engaged,
    new_anchors,
)
from tissue.blade.edge_forces import apply_edge_forces, clear_anchor_forces
from tissue.blade.edge_search import (
    anchor_beside,
    anchor_entering,
    any_free_in_box,
    free_retracted,
)
from tissue.blade.forces import LIMIT_AT_BLADE, frequency_with_blade, limit_frequency_at_blade
from tissue.blade.material_frame import to_material
from tissue.blade.return_mapping import locate, set_anchor, slip_anchors
from tissue.blade.toughness import toughness_law_of
from tissue.core.vec3 import Vec3, vec3
from tissue.cutting.blade_path import new_path
from tissue.elasticity.springs import no_springs
from tissue.mesh.body import CUT, OUTER, build_body, walk
from tissue.mesh.star import no_visits
from tissue.mesh.tetrahedron_grid import build_grid

pytestmark = pytest.mark.kernel

BLOCK = block((2, 4, 2), (0.02, 0.04, 0.02))
STIFF, TOUGH = 10e3, 20.0
BOX = (Vec3(0.0, 0.0, 0.0), Vec3(0.02, 0.04, 0.02))
"""Lowest and highest corner of the block [m]."""

N = 5
REACH = 0.005
"""Reach of the blade state [m]."""


def edge_at(y, x=0.011, z=0.001, length=0.016):
    """Return an upright edge inside the block that does not move and faces along y."""
    tip, heel, forward = Vec3(x, y, z), Vec3(x, y, z + length), Vec3(0.0, 1.0, 0.0)
    return Edge(tip, heel, forward, tip, heel, forward)


class AnchoredBlade:
    """A block in which five samples of the edge are anchored, at y = 9 mm."""

    def __init__(self):
        self.body = build_body(BLOCK, None, None)
        self.springs = springs_of(self.body)
        self.visits = no_visits(len(BLOCK.positions), len(BLOCK.tetrahedra))
        self.anchors = new_anchors(N, 0.016, 4.0 * STIFF)
        self.blade = line_blade(self.anchors, Material(toughness=TOUGH)).replaced(reach=REACH)
        self.forces = np.zeros_like(self.body.rest)
        grid = build_grid(self.body, self.body.positions, 0.0)
        anchor_entering(self.blade, self.body, grid, edge_at(0.009), 1.0, 1e-3, *BOX)

    def set_toughness(self, **properties):
        self.blade = self.blade.replaced(toughness=toughness_law_of(Material(**properties), None))

    def pull(self, edge):
        x = self.body.positions
        clear_anchor_forces(self.anchors, self.body, self.forces)
        apply_edge_forces(self.blade, self.body, motion_at(edge, 1.0), x, 1.0, 1.0, self.forces)
        return self.blade.totals

    def slip(self, edge):
        slip_anchors(self.blade, self.body, self.visits, pose_at(edge, 1.0), 1.0)


@pytest.fixture
def held():
    return AnchoredBlade()


def is_zero(totals):
    """Return whether there was no impulse between blade and tissue."""
    impulses = (totals.impulse, totals.angular_impulse, totals.impulse_on_tissue)
    return not np.concatenate(impulses).any()


THRESHOLD = TOUGH / (4.0 * STIFF)
"""Distance of the edge ahead of its anchors at which they begin to slip [m]: J l / (4 E l)."""


def test_a_sample_in_the_tissue_is_anchored_where_it_is(held):
    assert (held.anchors.state == ANCHORED).all()
    np.testing.assert_allclose(held.anchors.rest[:, :2], [[0.011, 0.009]] * N, atol=1e-15)


@pytest.mark.parametrize(
    ("toughness", "factor"),
    [(1.0, 4.0), (60.0, 20.0), (1e3, 64.0)],
    ids=["soft", "tough", "most"],
)
def test_anchors_stretch_by_a_share_of_a_node_at_most_where_tissue_stiffens(toughness, factor):
    """J / (0.3 x 1 mm) between 4 and 64 times Young's modulus; without stiffening always 4."""
    stiffens = Material(law="exponential", stiffening=15.0, young_modulus=10e3)
    assert anchor_stiffness(stiffens, toughness, 1e-3) == pytest.approx(factor * 10e3)
    assert anchor_stiffness(Material(young_modulus=10e3), toughness, 1e-3) == 4.0 * 10e3


def test_a_sample_outside_stays_free_and_pulls_nothing(held):
    anchors = new_anchors(N, 0.016, 4.0 * STIFF)
    grid = build_grid(held.body, held.body.positions, 0.0)
    assert not any_free_in_box(anchors, pose_at(edge_at(-0.001), 1.0), *BOX)
    assert any_free_in_box(anchors, pose_at(edge_at(0.001), 1.0), *BOX)
    held.blade = held.blade.replaced(anchors=anchors)
    anchor_entering(held.blade, held.body, grid, edge_at(-0.001), 1.0, 1e-3, *BOX)
    assert not is_engaged(anchors)
    totals = held.pull(edge_at(-0.001))
    assert is_zero(totals)
    assert totals.work_of_blade == totals.work_of_cutting == totals.released == 0.0
    assert not held.forces.any()


def test_a_pull_below_toughness_times_length_does_not_slip(held):
    before = held.anchors.rest.copy()
    held.slip(edge_at(0.009 + 0.99 * THRESHOLD))
    np.testing.assert_array_equal(held.anchors.rest, before)
    assert held.blade.totals.work_of_cutting == 0.0


def test_a_stronger_pull_slips_until_toughness_times_length_remains(held):
    edge = edge_at(0.009 + 3.0 * THRESHOLD)
    held.slip(edge)
    np.testing.assert_allclose(held.anchors.rest[:, 1], 0.009 + 2.0 * THRESHOLD, rtol=1e-12)
    totals = held.pull(edge)
    assert totals.impulse_on_tissue[1] == pytest.approx(TOUGH * 0.016, rel=1e-12)


def test_skin_resists_more_until_it_breaks_and_then_as_much_as_the_tissue_below(held):
    held.set_toughness(toughness=TOUGH, skin_toughness=3.0 * TOUGH)
    before = held.anchors.rest.copy()
    held.slip(edge_at(0.009 + 2.9 * THRESHOLD))
    np.testing.assert_array_equal(held.anchors.rest, before)
    held.slip(edge_at(0.009 + 3.1 * THRESHOLD))
    np.testing.assert_allclose(held.anchors.rest[:, 1], 0.009 + 2.1 * THRESHOLD, rtol=1e-12)
    assert not held.anchors.at_skin.any()
    # The spring releases (9 - 1) / 2 plus 3 x 0.1 and the area takes 2.1; the rest breaks the skin.
    unit = TOUGH * 0.016 * THRESHOLD
    assert held.blade.totals.work_of_breaking == pytest.approx(2.2 * unit, rel=1e-6)


def test_a_pull_across_the_side_face_never_slips(held):
    before = held.anchors.rest.copy()
    held.slip(edge_at(0.009, x=0.011 + 10.0 * THRESHOLD))
    np.testing.assert_allclose(held.anchors.rest, before, atol=1e-12)
    assert held.blade.totals.work_of_cutting == 0.0


def test_a_blade_that_backs_off_has_no_force_and_is_anchored_again_where_it_was(held):
    before = held.anchors.rest.copy()
    held.slip(edge_at(0.009 - 0.001))
    assert (held.anchors.state == RETRACTED).all()
    assert is_zero(held.pull(edge_at(0.008)))
    held.slip(edge_at(0.009 + 0.5 * THRESHOLD))
    assert (held.anchors.state == ANCHORED).all()
    np.testing.assert_array_equal(held.anchors.rest, before)


def test_a_blade_that_backs_off_and_moves_aside_beyond_reach_is_free(held):
    held.slip(edge_at(0.003, x=0.019))
    assert (held.anchors.state == FREE).all()


@pytest.mark.parametrize(("first", "continues"), [(N - 1, True), (0, False)])
def test_the_path_of_a_freed_sample_continues_beside_an_anchored_one_and_else_restarts(
    held, first, continues
):
    path = new_path(N)
    path.known[:] = True
    held.anchors.state[first:] = RETRACTED
    free_retracted(held.blade, held.body, held.visits, path, pose_at(edge_at(0.012), 1.0))
    assert (held.anchors.state[first:] == FREE).all()
    assert path.known[N - 1] == continues


STIFFNESS = 4.0 * STIFF * 0.016
"""Stiffness of all anchors together [N/m]."""


ASIDE = 0.0005
"""How far the edge is beside its anchors [m]."""

HELD_ASIDE = 0.5 * STIFFNESS * ASIDE**2
"""What the anchors hold there [J]."""


def go_back_from_aside(held):
    """Have the edge pull to the side, and back off from there."""
    held.slip(edge_at(0.009 + 1e-9, x=0.011 + ASIDE))
    held.slip(edge_at(0.009 - 0.001, x=0.011 + ASIDE))


def come_back_aside(held):
    """Have the edge back off, and come back beside where it cut; return where it is then."""
    go_back_from_aside(held)
    here = edge_at(0.009 + 1e-9, x=0.011 + ASIDE)
    held.slip(here)
    assert (held.anchors.state == ANCHORED).all()
    return here


def test_backing_off_releases_what_was_held_aside(held):
    go_back_from_aside(held)
    assert held.blade.totals.released == pytest.approx(HELD_ASIDE, rel=1e-5)


def test_an_edge_that_comes_back_beside_where_it_cut_begins_without_a_pull(held):
    here = come_back_aside(held)
    assert np.linalg.norm(held.pull(here).impulse) < 1e-4 * STIFFNESS * ASIDE
    assert held.blade.totals.released == pytest.approx(HELD_ASIDE, rel=1e-5)


@pytest.mark.parametrize("about", [(0.0, 0.0, 0.0), (0.3, -1.0, 2.0)])
def test_forces_and_torques_cancel_for_an_edge_that_came_back_beside_where_it_cut(held, about):
    come_back_aside(held)
    totals = held.pull(deform(held))
    assert np.linalg.norm(totals.impulse) > 0.1
    on_blade = totals.angular_impulse - np.cross(about, totals.impulse)
    on_nodes = np.cross(held.body.positions - about, held.forces).sum(axis=0)
    np.testing.assert_allclose(held.forces.sum(axis=0) + totals.impulse, 0.0, atol=1e-14)
    np.testing.assert_allclose(on_blade + on_nodes, 0.0, atol=1e-12)


def test_an_anchor_that_is_set_behind_the_edge_is_in_the_account_once_it_pulls(held):
    behind, ahead = (pose_at(edge_at(0.009 + dy, x=0.0111), 1.0) for dy in (-1e-5, 1e-5))
    held.anchors.state[0] = FREE
    anchor_beside(held.blade, held.body, held.visits, behind, 0.001)
    assert held.anchors.state[0] == ANCHORED
    assert held.blade.totals.released == 0.0
    held.anchors.state[1:] = FREE
    slip_anchors(held.blade, held.body, held.visits, ahead, 1.0)
    stored = anchors_energy(held.anchors, held.body, ahead, held.blade.toughness)
    assert stored > 0.0
    assert held.blade.totals.released == pytest.approx(-stored, rel=1e-9)


def test_a_sample_that_slips_out_through_the_skin_is_marked_as_left(held):
    for i in range(40):
        held.slip(edge_at(0.009 + i * 0.001))
    assert (held.anchors.state == LEFT).all()


def deform(held):
    """Move the nodes of the block at random; return an edge ahead of its anchors, rotated."""
    random = np.random.default_rng(0)
    held.body.positions[:] += random.normal(size=held.body.rest.shape) * 5e-4
    tip, heel = Vec3(0.0115, 0.0096, 0.0012), Vec3(0.0107, 0.0102, 0.0171)
    return Edge(tip, heel, Vec3(0.0, 1.0, 0.0), tip, heel, Vec3(0.0, 1.0, 0.0))


def test_clearing_anchor_forces_leaves_no_force_on_the_nodes(held):
    held.pull(deform(held))
    clear_anchor_forces(held.anchors, held.body, held.forces)
    assert not held.forces.any()


def test_free_neighbours_of_an_anchored_sample_inside_the_tissue_are_anchored(held):
    held.anchors.state[:] = FREE
    held.anchors.state[2] = ANCHORED
    anchor_beside(held.blade, held.body, held.visits, pose_at(edge_at(0.0095), 1.0), 0.001)
    assert (held.anchors.state == ANCHORED).all()
    np.testing.assert_allclose(held.anchors.rest[:, 1], 0.009, atol=1e-12)


def test_anchors_raise_the_bound_on_frequency_by_their_stiffness(held):
    scratch = np.zeros_like(held.body.rest)
    none = np.zeros(len(held.body.rest))
    bound = frequency_with_blade(held.blade, held.body, none, scratch)
    assert not scratch.any()
    assert bound > 4.0 * STIFF * held.anchors.length[0] / held.body.masses.sum()
    held.anchors.state[:] = FREE
    assert frequency_with_blade(held.blade, held.body, none, scratch) == 0.0


def test_nodes_that_the_edge_makes_faster_than_the_limit_get_mass(held):
    scratch, body, n = np.zeros_like(held.body.rest), held.body, held.body.n_nodes
    elastic, masses = elastic_of(no_springs(n, 0), n), held.body.masses[:n].copy()
    highest = frequency_with_blade(held.blade, body, elastic.frequency_squared, scratch)
    allowed = 0.5 * highest / LIMIT_AT_BLADE
    elastic.scaling.allowed_between_cuts, elastic.scaling.most = allowed, np.inf
    bound = limit_frequency_at_blade(held.blade, elastic, body, scratch)
    assert bound == pytest.approx(0.5 * highest, rel=1e-12)
    assert frequency_with_blade(held.blade, body, elastic.frequency_squared, scratch) == bound
    heavier = body.masses[:n] > masses
    assert 0 < heavier.sum() < n
    np.testing.assert_allclose(body.added_masses[:n], body.masses[:n] - masses, atol=1e-18)
    assert not scratch.any()


def test_a_displacement_in_a_stretched_body_is_mapped_back_to_rest(held):
    held.body.positions[:] = held.body.rest * [1.0, 1.5, 1.0]
    assert to_material(held.body, 0, Vec3(0.0, 0.003, 0.0)) == pytest.approx((0.0, 0.002, 0.0))


def test_a_displacement_in_a_crushed_tetrahedron_is_not_changed(held):
    held.body.positions[:] = held.body.rest * [1.0, 1e-3, 1.0]
    assert to_material(held.body, 0, Vec3(0.0, 0.003, 0.0)) == (0.0, 0.003, 0.0)


def test_a_search_goes_around_the_rim_of_a_cut(held):
    """The left half of the block is cut at y = 20 mm; the search goes around the cut."""
    body = held.body
    rest = body.rest[body.tetrahedra]
    for t, f in np.argwhere(body.links >= 0):
        face = np.delete(rest[t], f, axis=0)
        if np.allclose(face[:, 1], 0.02) and (face[:, 0] < 0.0101).all():
            body.links[t, f] = CUT
    beyond = Vec3(0.003, 0.023, 0.004)
    start = walk(body, Vec3(0.003, 0.017, 0.004), 0).tetrahedron
    assert walk(body, beyond, start).link == CUT
    place = locate(body, held.visits, beyond, start, held.blade.queue)
    assert place.inside
    assert body.rest[body.tetrahedra[place.tetrahedron], 1].mean() > 0.02


def gaping_block(way):
    """Return a block whose left half is cut at y = 20 mm; the far lip has moved by `way` [m]."""
    x, tetrahedra = BLOCK.positions, BLOCK.tetrahedra.copy()
    on_lip = np.flatnonzero(np.isclose(x[:, 1], 0.02) & (x[:, 0] < 0.0099))
    own = np.arange(len(x))
    own[on_lip] = len(x) + np.arange(len(on_lip))
    is_beyond = x[tetrahedra].mean(axis=1)[:, 1] > 0.02
    tetrahedra[is_beyond] = own[tetrahedra[is_beyond]]
    body = build_body(TetrahedralMesh(np.concatenate((x, x[on_lip])), tetrahedra), None, None)
    for t, f in np.argwhere(body.links == OUTER):
        face = np.delete(body.rest[tetrahedra[t]], f, axis=0)
        if np.allclose(face[:, 1], 0.02):
            body.links[t, f] = CUT
    body.positions[len(x) :] += way
    return body


@pytest.mark.parametrize("gap", [0.0, 0.004])
def test_an_anchor_that_slips_to_the_other_lip_of_an_open_cut_lets_go(held, gap):
    """On a closed lip it goes on; across a gap the slip would store energy in its spring."""
    body = gaping_block(np.array([gap, 0.0, 0.0]))
    for k in range(N):
        at = Vec3(0.003, 0.0195, 0.001 + 0.004 * k)
        set_anchor(held.anchors, body, k, walk(body, at, 0).tetrahedron, at)
    edge = pose_at(edge_at(0.021, x=0.003), 1.0)
    stored = anchors_energy(held.anchors, body, edge, held.blade.toughness)
    slip_anchors(held.blade, body, no_visits(len(body.rest), len(body.tetrahedra)), edge, 1.0)
    if gap == 0.0:
        assert (held.anchors.state == ANCHORED).all()
        assert (held.anchors.rest[:, 1] > 0.02).all()
        return
    assert (held.anchors.state == LEFT).all()
    np.testing.assert_allclose(held.anchors.rest[:, 1], 0.0195, atol=1e-9)
    totals = held.blade.totals
    assert totals.work_of_cutting == totals.work_of_breaking == 0.0
    assert totals.released == pytest.approx(stored, rel=1e-9)


def test_an_anchor_outside_the_tissue_is_moved_into_it(held):
    set_anchor(held.anchors, held.body, 0, 0, Vec3(0.011, 0.0, -0.5))
    assert (held.anchors.weights[0] >= 0.0).all()
    assert held.anchors.weights[0].sum() == pytest.approx(1.0)
    low, high = BLOCK.positions.min(axis=0), BLOCK.positions.max(axis=0)
    assert (low <= vec3(held.anchors.rest, 0)).all()
    assert (vec3(held.anchors.rest, 0) <= high).all()


def test_anchored_length_is_that_of_the_anchored_samples(held):
    assert anchored_length(held.anchors) == pytest.approx(0.016)
    held.anchors.state[0] = RETRACTED
    assert anchored_length(held.anchors) == pytest.approx(0.014)
