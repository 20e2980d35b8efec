"""Several bodies as one mesh: names, places, what overlaps, and what is welded."""

import numpy as np
import pytest

from tissue import MeshError, TetrahedralMesh, Tissue, block, fixed_nodes, joined, placed

LOW = block((4, 4, 2), (0.04, 0.04, 0.02))
HIGH = block((3, 3, 2), (0.025, 0.025, 0.015))
QUARTER_TURN = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def halves(mesh: TetrahedralMesh) -> TetrahedralMesh:
    """Return a mesh of two labels, of which one has a name."""
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    return mesh._replace(labels=7 * (middles[:, 0] > 0.01), label_names={7: "vessel"})


def test_each_body_has_labels_of_its_own_and_keeps_its_nodes():
    mesh = joined({"liver": halves(LOW), "fat": placed(HIGH, (0.0, 0.0, 0.02))})
    assert dict(mesh.label_names) == {1: "liver/0", 2: "liver/vessel", 3: "fat"}
    n, t = len(LOW.positions), len(LOW.tetrahedra)
    np.testing.assert_array_equal(mesh.positions[n:], HIGH.positions + np.array([0.0, 0.0, 0.02]))
    np.testing.assert_array_equal(mesh.tetrahedra[t:], HIGH.tetrahedra + n)
    np.testing.assert_array_equal(mesh.labels[:t] == 2, halves(LOW).labels == 7)
    assert (mesh.labels[t:] == 3).all()
    assert Tissue(mesh).n_pieces() == 2


def test_a_region_may_be_that_of_one_body():
    mesh = joined({"liver": halves(LOW), "fat": placed(HIGH, (0.0, 0.0, 0.02))})
    n = len(LOW.positions)
    bottom = np.flatnonzero(fixed_nodes(mesh, "bottom", "fat"))
    np.testing.assert_array_equal(bottom, n + np.flatnonzero(HIGH.positions[:, 2] == 0.0))
    assert fixed_nodes(mesh, "top", "liver").sum() == 25  # of both its labels
    with pytest.raises(ValueError, match=r"no tetrahedron has label 'skin'; there is 1"):
        fixed_nodes(mesh, "top", "skin")
    with pytest.raises(ValueError, match=r"of 'fat': no node"):
        fixed_nodes(mesh, "0,0,0:0.01,0.01,0.01", "fat")


def test_a_mesh_is_turned_about_its_origin_and_then_moved():
    found = placed(HIGH, (1.0, 0.0, 0.0), QUARTER_TURN).positions
    x, y, z = HIGH.positions.T
    np.testing.assert_allclose(found, np.stack([1.0 - y, x, z], axis=1), atol=1e-15)


@pytest.mark.parametrize(
    "other",
    [
        placed(HIGH, (0.0071, 0.0071, 0.0199)),  # by a tenth of a millimetre
        placed(HIGH, (0.0071, 0.0071, 0.003)),  # one inside the other
        placed(LOW),  # the same place
        placed(block((9, 1, 1), (0.09, 0.003, 0.003)), (-0.02, 0.0171, 0.0085)),  # a stick through
    ],
)
def test_bodies_that_overlap_are_refused_by_their_names(other):
    with pytest.raises(MeshError, match=r"'liver' and 'fat' overlap, by .* mm or more, near \("):
        joined({"liver": LOW, "fat": other})


def test_bodies_whose_boxes_overlap_may_lie_apart():
    """Two beams, one turned by 45 degrees beside the corner of the other."""
    beam, half = block((6, 1, 1), (0.06, 0.01, 0.01)), np.sqrt(0.5)
    turn = np.array([[half, -half, 0.0], [half, half, 0.0], [0.0, 0.0, 1.0]])
    apart = placed(beam, (0.058, -0.02, 0.0), turn)
    assert (apart.positions.min(axis=0) < beam.positions.max(axis=0)).all()
    assert (apart.positions.max(axis=0) > beam.positions.min(axis=0)).all()
    assert len(joined({"one": beam, "other": apart}).tetrahedra) == 2 * len(beam.tetrahedra)


def test_welded_bodies_are_one_piece_where_faces_lie_node_on_node():
    high = placed(block((2, 2, 1), (0.02, 0.02, 0.01)), (0.01, 0.01, 0.02))
    mesh = joined({"low": LOW, "high": high}, weld=["high"])
    assert len(mesh.positions) == len(LOW.positions) + len(high.positions) - 9
    assert Tissue(mesh).n_pieces() == 1
    assert Tissue(joined({"low": LOW, "high": high})).n_pieces() == 2


@pytest.mark.parametrize("at", [(0.0071, 0.0071, 0.02), (0.04, 0.04, 0.02)], ids=["off", "corner"])
def test_what_shares_no_face_cannot_be_welded(at):
    with pytest.raises(MeshError, match="body 'high' cannot be welded"):
        joined({"low": LOW, "high": placed(LOW, at)}, weld=["high"])


def test_names_that_no_body_can_have_are_refused():
    for name in ("", "liver/left"):
        with pytest.raises(ValueError, match="a name is a text without '/'"):
            joined({name: LOW})
    with pytest.raises(ValueError, match="no body 'fat' to weld"):
        joined({"liver": LOW}, weld=["fat"])
    with pytest.raises(MeshError, match="there is no body"):
        joined({})
