"""Shapes that touch are filled without a gap: neighbours of different labels share their faces."""

import numpy as np
import pytest

from tissue import TetrahedralMesh
from tissue.mesh.faces import sorted_faces
from tissue.mesh.validation import checked, quality, signed_volumes
from tissue.shapes.isosurface_stuffing import stuff
from tissue.shapes.labelled_stuffing import stuff_labels

BOX = [[-0.05] * 3, [0.05] * 3]
RADIUS = 0.03


def nearest_of(centres):
    """The ball of `RADIUS`, divided into the places that are nearest to each centre."""

    def depth(points, labels):
        ways = np.linalg.norm(points - np.vstack([[0.0] * 3, centres])[labels], axis=1)
        outside = np.linalg.norm(points, axis=1) - RADIUS
        return np.where(labels == 0, outside, RADIUS - ways + outside.clip(max=0.0))

    return depth


def divided_ball(centres, spacing=0.007):
    return stuff_labels(nearest_of(np.asarray(centres)), len(centres), BOX, spacing)


def random_centres(seed, n=5):
    return np.random.default_rng(seed).normal(0.0, 0.01, (n, 3))


@pytest.mark.parametrize("seed", range(4))
def test_neighbours_of_several_labels_agree_on_every_face(seed):
    mesh = divided_ball(random_centres(seed))
    assert set(np.unique(mesh.labels)) == {1, 2, 3, 4, 5}
    result = checked(mesh)
    assert len(result.mesh.positions) == len(mesh.positions)
    whole = signed_volumes(mesh.positions, mesh.tetrahedra).sum()
    triangles = mesh.positions[skin(mesh)]
    assert np.linalg.det(triangles).sum() / 6.0 == pytest.approx(whole, rel=1e-12)


def skin(mesh):
    faces = sorted_faces(mesh.tetrahedra)
    assert faces.counts.max() == 2
    tets, local = np.divmod(faces.halves[faces.starts[faces.counts == 1]], 4)
    opposite = np.array([[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]])
    return np.take_along_axis(mesh.tetrahedra[tets], opposite[local], axis=1)


def test_the_face_between_two_labels_is_where_they_meet():
    mesh = divided_ball([[0.0, 0.0, 0.0131], [0.0, 0.0, -0.007]])
    faces = sorted_faces(mesh.tetrahedra)
    a, b = faces.halves[faces.starts[faces.counts == 2][:, None] + [0, 1]].T // 4
    between = mesh.labels[a] != mesh.labels[b]
    shared = [
        set(p) & set(q)
        for p, q in zip(
            mesh.tetrahedra[a[between]].tolist(), mesh.tetrahedra[b[between]].tolist(), strict=True
        )
    ]
    nodes = sorted(set().union(*shared))
    inner = nodes_inside(mesh, nodes)
    assert len(inner) > 20
    np.testing.assert_allclose(mesh.positions[inner, 2], 0.00305, atol=1e-9)


def nodes_inside(mesh, nodes):
    return [n for n in nodes if n not in set(skin(mesh).ravel().tolist())]


def test_one_label_is_the_mesh_of_one_shape():
    def depth(points, labels):
        inside = RADIUS - np.linalg.norm(points, axis=1)
        return np.where(labels == 0, -inside, inside)

    mesh = stuff_labels(depth, 1, BOX, 0.007)
    alone = stuff(lambda points: RADIUS - np.linalg.norm(points, axis=1), BOX, 0.007)
    for own, other in zip(in_order(mesh), in_order(alone), strict=True):
        np.testing.assert_allclose(own, other, atol=1e-12)


def in_order(mesh):
    corners = mesh.positions[mesh.tetrahedra].mean(axis=1).round(9)
    order = np.lexsort(corners.T)
    return corners[order], signed_volumes(*TetrahedralMesh(mesh.positions, mesh.tetrahedra)[:2])[
        order
    ]


def test_no_tetrahedron_is_flat_where_a_surface_lies_in_the_lattice():
    for height in np.linspace(0.0, 0.007, 8):
        mesh = divided_ball([[0.0, 0.0, 0.01 + height], [0.0, 0.0, -0.01 + height]])
        assert quality(mesh.positions, mesh.tetrahedra).min() > 1e-2


@pytest.mark.parametrize(
    ("bounds", "spacing", "said"),
    [([[-0.02] * 3, [0.02] * 3], 0.007, "not within the bounds"), (BOX, 1e-6, "make it larger")],
)
def test_shapes_that_do_not_fit_are_refused(bounds, spacing, said):
    with pytest.raises(ValueError, match=said):
        stuff_labels(nearest_of(random_centres(0)), 5, bounds, spacing)


def test_where_a_border_ends_in_the_skin_no_tooth_of_a_label_is_left():
    """Nodes of both labels and the skin are where the plane between them leaves the two balls."""
    centres = np.array([[0.0, 0.0, 0.0131], [0.0, 0.0, -0.007]])
    mesh = divided_ball(centres, spacing=0.006)
    labels, rim = mesh.labels, np.unique(skin(mesh))
    both = set(mesh.tetrahedra[labels == 1].ravel()) & set(mesh.tetrahedra[labels == 2].ravel())
    rim = [n for n in rim if n in both]
    assert len(rim) > 20
    np.testing.assert_allclose(mesh.positions[rim, 2], 0.00305, atol=0.02 * 0.006)
    ways = np.linalg.norm(mesh.positions[rim] - centres[0], axis=1)
    np.testing.assert_allclose(ways, RADIUS, atol=0.02 * 0.006)
