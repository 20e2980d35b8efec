"""Faces are those of the links of the body, and their normals and boxes those of NumPy."""

import numpy as np
import pytest

from tests.support.overlaps import joined
from tissue import block
from tissue.contact.geometry.faces import (
    NO_FACE,
    has_inverted,
    may_touch,
    new_faces,
    update_changed_faces,
    update_normals,
    update_piece_boxes,
    with_found_pieces,
    with_room,
)
from tissue.mesh.body import CUT, OUTER, build_body
from tissue.mesh.changes import new_change

pytestmark = pytest.mark.kernel


def two_blocks(gap):
    """Return the body of two blocks of 20 mm, that far apart along x [m], and its skin."""
    one = block((2, 2, 2), (0.02, 0.02, 0.02))
    body = build_body(joined(one, one, (0.02 + gap, 0.0, 0.0)), None, None)
    return body, with_found_pieces(new_faces(body.n_tetrahedra), body)


def test_faces_that_changed_are_those_of_the_links():
    body = build_body(block((2, 2, 2), (0.02, 0.02, 0.02)), None, None)
    faces, random = new_faces(len(body.tetrahedra)), np.random.default_rng(0)
    intact = body.links.copy()
    for _ in range(5):
        change = new_change()
        opened = random.choice(np.flatnonzero(intact.ravel() >= 0), 30, replace=False)
        changed = np.unique(np.concatenate([opened, np.flatnonzero(body.links == CUT)]) // 4)
        body.links[:] = intact
        body.links.ravel()[opened] = CUT
        change.n_dirty = len(changed)
        change.dirty[: len(changed)] = changed
        faces = with_room(faces, 4 * len(changed))
        update_changed_faces(faces, body, change)
        listed = faces.face[: faces.n_places]
        assert sorted(listed[listed != NO_FACE]) == sorted(opened)
        assert (faces.face[faces.place.ravel()[opened]] == opened).all()
        assert faces.n_free == np.sum(listed == NO_FACE)
    assert faces.n_places <= 60, "places are used again"


def test_normals_are_sums_over_faces_and_inverted_tetrahedra_are_found():
    body, faces = two_blocks(0.001)
    body.positions[:] += np.random.default_rng(1).normal(scale=6e-3, size=body.positions.shape)
    normal, inverted = np.ones_like(body.positions), np.zeros(body.n_nodes, np.int64)
    update_normals(faces, body, normal, inverted, 7)
    is_skin = body.links == OUTER
    wanted, turned = np.zeros_like(normal), set()
    for t, f in zip(*np.nonzero(is_skin), strict=True):
        nodes = faces.node[faces.place[t, f]]
        a, b, c, behind = body.positions[nodes]
        area = np.cross(b - a, c - a)
        np.add.at(wanted, nodes[:3], area)
        if area @ (a - behind) <= 0.0:
            turned.update(map(int, nodes))
    on_skin = np.unique(body.tetrahedra[np.nonzero(is_skin)[0]])
    on_skin = [node for node in on_skin if wanted[node].any()]
    np.testing.assert_allclose(normal[on_skin], wanted[on_skin], atol=1e-12)
    assert set(np.flatnonzero(inverted == 7)) == turned and turned
    inside = next(iter(turned))
    assert has_inverted(inverted, 7, (inside, 0, 0, 0))


@pytest.mark.parametrize(("gap", "is_far"), [(0.0009, False), (0.0011, True)])
def test_skin_is_far_beyond_the_reach_of_the_box_of_another_piece(gap, is_far):
    body, faces = two_blocks(gap)
    update_piece_boxes(faces, body, 0.001)
    for p in range(2):
        nodes = np.unique(body.tetrahedra[faces.piece[: body.n_tetrahedra] == p])
        np.testing.assert_array_equal(faces.piece_low[p], body.positions[nodes].min(axis=0))
        np.testing.assert_array_equal(faces.piece_high[p], body.positions[nodes].max(axis=0))
    assert list(faces.is_piece_far) == [is_far, is_far]
    near = [may_touch(faces, body, at, 0.001, True) for at in range(faces.n_places)]
    ends = body.positions[faces.node[: faces.n_places, :3], 0].reshape(-1, 3)
    facing = (ends == 0.02).all(axis=1) | (ends == 0.02 + gap).all(axis=1)
    assert is_far != np.any(near)
    assert is_far or np.all(np.array(near)[facing])
