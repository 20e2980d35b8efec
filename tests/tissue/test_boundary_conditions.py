import numpy as np
import pytest

from tissue import TetrahedralMesh, block, fixed_nodes, liver_lobe
from tissue.boundary_conditions import (
    SIDES,
    box_nodes,
    label_nodes,
    listed_nodes,
    plane_nodes,
    side_nodes,
)
from tissue.mesh.faces import boundary_faces


@pytest.mark.parametrize("side", SIDES)
@pytest.mark.parametrize("cells", [(1, 1, 1), (4, 6, 4), (60, 2, 3)])
def test_a_side_of_a_grid_is_exactly_its_plane(side, cells):
    mesh = block(cells, (0.04, 0.06, 0.01))
    axis, is_high = SIDES[side]
    plane = (0.04, 0.06, 0.01)[axis] if is_high else 0.0
    assert np.array_equal(side_nodes(mesh, [side]), mesh.positions[:, axis] == plane)


def test_a_side_with_single_precision_errors_still_counts_as_flat():
    mesh = block((10, 2, 2))
    bent = mesh.positions.astype(np.float32) * np.float32(1.1) + np.float32(0.003)
    nodes = side_nodes(TetrahedralMesh(bent.astype(float), mesh.tetrahedra), ["right"])
    assert nodes.sum() == 9


@pytest.mark.parametrize("side", SIDES)
def test_a_side_of_the_organ_is_a_cap_of_its_surface_that_prevents_rotation(side):
    mesh = liver_lobe()
    axis, is_high = SIDES[side]
    nodes = side_nodes(mesh, [side])
    depth = mesh.positions[:, axis] if not is_high else -mesh.positions[:, axis]
    depth = (depth - depth.min()) / np.ptp(depth)
    assert set(np.flatnonzero(nodes)) <= set(boundary_faces(mesh.tetrahedra).ravel())
    assert depth[nodes].max() <= 0.05
    assert np.linalg.matrix_rank(mesh.positions[nodes] - mesh.positions[nodes][0], tol=1e-3) >= 2


def test_the_underside_is_all_of_the_surface_that_faces_down():
    cells = block((2, 2, 2))
    lying = fixed_nodes(cells, "underside")
    assert np.array_equal(lying, cells.positions[:, 2] == 0.0)
    both = fixed_nodes(cells, "left, Underside")
    assert np.array_equal(both, lying | (cells.positions[:, 0] == 0.0))
    arch = cells.tetrahedra[
        ~(
            (
                cells.positions[cells.tetrahedra].mean(axis=1)[:, [0, 2]]
                < 0.5 * cells.positions.max(axis=0)[[0, 2]]
            ).all(axis=1)
        )
    ]
    under_arch = fixed_nodes(TetrahedralMesh(cells.positions, arch), "underside")
    heights = np.unique(cells.positions[under_arch, 2])
    assert np.allclose(heights, [0.0, 0.5 * cells.positions[:, 2].max()])


def test_a_side_that_ends_in_a_point_is_deepened_until_it_has_three_nodes():
    tip = [[1.0, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]]
    mesh = TetrahedralMesh(0.1 * np.array(tip), np.array([[0, 1, 3, 2]]))
    assert side_nodes(mesh, ["right"]).sum() >= 3


def test_sides_can_be_combined_in_one_text():
    mesh = block()
    left_and_right = side_nodes(mesh, ["left"]) | side_nodes(mesh, ["right"])
    assert np.array_equal(fixed_nodes(mesh, " Left, right "), left_and_right)
    assert left_and_right.sum() == 2 * 35


def test_none_holds_nothing():
    assert not fixed_nodes(block(), "none").any()


def test_a_box_holds_the_nodes_on_its_faces_too():
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    assert fixed_nodes(mesh, "0,0,0:0.01,0.01,0.01").sum() == 8
    assert box_nodes(mesh, (0.0, 0.0, 0.02), (1.0, 1.0, 0.02)).sum() == 9


def test_a_sphere_holds_the_nodes_on_it_too():
    """The corner at the origin and its three neighbours, at just that radius."""
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    held = fixed_nodes(mesh, "sphere:0,0,0,0.01")
    assert np.array_equal(held, np.linalg.norm(mesh.positions, axis=1) <= 0.01)
    assert held.sum() == 4


def test_a_plane_with_an_outward_normal_holds_the_nodes_on_it():
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    assert plane_nodes(mesh, (0.0, 0.0, 0.0), (0.0, 0.0, -5.0)).sum() == 9
    assert plane_nodes(mesh, (0.0, 0.0, 0.01), (0.0, 0.0, 1.0)).sum() == 18


def test_a_list_holds_the_nodes_in_it():
    assert np.array_equal(np.flatnonzero(listed_nodes(block(), [7, 0, 7])), [0, 7])
    assert not listed_nodes(block(), []).any()


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("lef,right", "Did you mean 'left'"),
        ("nothing at all", "Sides: left, right"),
        ("", "not a side"),
        ("left,,right", "not a side"),
        ("0,0:1,1", "x0,y0,z0:x1,y1,z1"),
        ("a,b,c:1,2,3", "x0,y0,z0:x1,y1,z1"),
        ("1,1,1:2,2,2", "no node is in the box.*the body goes from"),
        ("1,1,1:0,0,0", "must be the smaller"),
        ("nan,0,0:1,1,1", "finite"),
        ("sphere:1,1,1,0.01", "no node is in the sphere.*the body goes from"),
        ("sphere:0,0,0", "sphere:x,y,z,r"),
        ("sphere:0,0,0,0.01,0.02", "sphere:x,y,z,r"),
        ("sphere:0,0,0,-0.01", "radius of the sphere is -0.01 m"),
        ("sphere:0,0,inf,0.01", "centre of the sphere .* finite"),
    ],
)
def test_a_text_that_selects_nothing_is_refused_with_valid_choices(text, message):
    with pytest.raises(ValueError, match=message):
        fixed_nodes(block(), text)


def test_missing_nodes_are_refused_by_number():
    with pytest.raises(ValueError, match=r"no node 175; .* 0 to 174"):
        listed_nodes(block(), [3, 175])
    with pytest.raises(ValueError, match="whole numbers"):
        listed_nodes(block(), [0.5])
    with pytest.raises(ValueError, match="no node is beyond the plane"):
        plane_nodes(block(), (1.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    with pytest.raises(ValueError, match="normal of the plane is zero"):
        plane_nodes(block(), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))


LABELLED = block((4, 4, 4), (0.04, 0.04, 0.04))
LABELLED = LABELLED._replace(
    labels=np.where(LABELLED.positions[LABELLED.tetrahedra].mean(axis=1)[:, 2] > 0.03, 2, 0),
    label_names={2: "bone, upper"},
)


@pytest.mark.parametrize("text", ["label:bone, upper", " LABEL: bone, upper", "label:2"])
def test_a_label_holds_all_nodes_of_its_tetrahedra(text):
    expected = LABELLED.positions[:, 2] > 0.029
    assert np.array_equal(fixed_nodes(LABELLED, text), expected)
    assert np.array_equal(label_nodes(LABELLED, 2), expected)


def test_a_label_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(ValueError, match=r"no tetrahedron has label 'bon'; there is 0, 2 \('bone"):
        fixed_nodes(LABELLED, "label:bon")
    with pytest.raises(ValueError, match="no tetrahedron has label 7; there is 0"):
        fixed_nodes(block((1, 1, 1)), "label:7")
