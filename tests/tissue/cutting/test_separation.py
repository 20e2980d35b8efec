"""Separation along the cut surface: which faces are cut, and which nodes are doubled."""

import numpy as np
import pytest

from tests.support import bodies, soundness
from tests.tissue.cutting.upright_edge import put_edge
from tests.tissue.kernels_of import cut_of
from tissue import block
from tissue.cutting.cut_surface import decide_side, note_side
from tissue.cutting.separation import open_cut_surface, tetrahedron_side
from tissue.cutting.workspace import flag
from tissue.mesh.body import CUT
from tissue.mesh.changes import NODES

pytestmark = pytest.mark.kernel


def two_halves():
    """Return a unit cube of 2 x 1 x 1 cells with its middle plane on the cut surface."""
    cut = cut_of(block((2, 1, 1), (1.0, 1.0, 1.0)))
    put_edge(cut, 0.5)
    x = cut.body.rest[: cut.body.n_nodes, 0]
    for node in np.flatnonzero(x == 0.5):
        flag(cut, node)
    return cut


def mesh_of(cut):
    return cut.body.tetrahedra[: cut.body.n_tetrahedra]


def test_faces_between_the_two_sides_of_the_cut_surface_are_cut_and_their_nodes_doubled():
    cut = two_halves()
    open_cut_surface(cut)
    assert cut.change.n_faces == 2  # the square in the middle
    assert cut.body.n_nodes == 12 + 4
    assert soundness.n_pieces(mesh_of(cut)) == 2
    assert soundness.link_faults(cut.body) == []
    assert cut.change.area == pytest.approx(1.0)


def test_where_there_is_no_room_to_double_a_node_the_cut_says_so():
    cut = two_halves()
    room, n = len(cut.body.rest), cut.body.n_nodes + 3
    arrays = {name: getattr(cut.body, name) for name in type(cut.body).__annotations__}
    short = {name: array[:n] for name, array in arrays.items() if np.shape(array)[:1] == (room,)}
    crowded = cut.replaced(body=cut.body.replaced(**short))
    open_cut_surface(crowded)
    assert crowded.body.n_nodes == 12 + 3
    assert crowded.change.lacks_room == NODES
    roomy = two_halves()
    open_cut_surface(roomy)
    assert roomy.change.lacks_room == 0


def test_a_face_with_a_node_off_the_cut_surface_is_not_cut():
    cut = cut_of(block((2, 1, 1), (1.0, 1.0, 1.0)))
    put_edge(cut, 0.5)
    on = np.flatnonzero(cut.body.rest[:12, 0] == 0.5)
    for node in on[:2]:
        flag(cut, node)
    open_cut_surface(cut)
    assert soundness.n_pieces(mesh_of(cut)) == 1
    assert cut.body.n_nodes == 12


def test_a_single_cut_face_inside_doubles_no_node():
    """The tetrahedra around its rim are still connected."""
    cut = cut_of(block((2, 2, 2), (1.0, 1.0, 1.0)))
    put_edge(cut, 0.5)
    tetrahedra = mesh_of(cut)
    rest = cut.body.rest
    faces = soundness.faces_of(tetrahedra)
    middle = [f for f in faces.nodes if (rest[f, 0] == 0.5).all() and 13 in f]
    for node in middle[0]:
        flag(cut, node)
    open_cut_surface(cut)
    assert cut.change.n_faces == 1
    assert cut.body.n_nodes == 27
    assert (cut.body.links[: len(tetrahedra)] == CUT).sum() == 2


def test_the_last_face_of_a_tetrahedron_is_not_cut():
    cut = cut_of(bodies.two_tetrahedra())
    put_edge(cut, 0.4)
    for node in (1, 2, 3):
        flag(cut, node)
    open_cut_surface(cut)
    assert cut.change.n_faces == 0
    assert cut.body.n_nodes == 5


def test_a_piece_smaller_than_a_fragment_stays_with_the_body():
    cut = two_halves()
    cut = cut.replaced(limits=cut.limits.replaced(crumb=0.51))
    open_cut_surface(cut)
    assert soundness.n_pieces(mesh_of(cut)) == 1
    assert cut.body.n_nodes == 12


# The side of a tetrahedron.


def one_tetrahedron(*on_cut_surface: int):
    """Return the corner of a cube with the given nodes on the cut surface at x = 0.3."""
    cut = cut_of(bodies.unit_tetrahedron())
    put_edge(cut, 0.3)
    for node in on_cut_surface:
        flag(cut, node)
    return cut


def test_a_decided_side_stays():
    cut = one_tetrahedron(0, 2, 3)
    decide_side(cut.surface, 0, -1)
    assert tetrahedron_side(cut, 0) == -1


def test_the_noted_side_of_a_node_outweighs_its_position():
    cut = one_tetrahedron(0, 2, 3)
    assert tetrahedron_side(cut, 0) == 1  # node 1 is at x = 1
    note_side(cut.surface, 1, -1, True)
    assert tetrahedron_side(cut, 0) == -1


def test_a_tetrahedron_with_nodes_noted_on_both_sides_is_undecided():
    cut = one_tetrahedron(2, 3)
    note_side(cut.surface, 0, -1, True)
    note_side(cut.surface, 1, 1, True)
    assert tetrahedron_side(cut, 0) == 0


def test_a_tetrahedron_that_lies_on_both_sides_is_undecided():
    assert tetrahedron_side(one_tetrahedron(2, 3), 0) == 0


def test_a_tetrahedron_with_all_nodes_on_the_cut_surface_is_on_the_side_of_its_centroid():
    assert tetrahedron_side(one_tetrahedron(0, 1, 2, 3), 0) == -1  # x = 0.25
