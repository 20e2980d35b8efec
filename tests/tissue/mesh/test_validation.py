import logging

import numpy as np
import pytest

from tissue import MeshError, TetrahedralMesh, block
from tissue.mesh.pieces import components
from tissue.mesh.validation import checked, expect_sound, quality, signed_volumes

CORNERS = 0.01 * np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def sound_block():
    mesh = block((2, 2, 2), (0.02, 0.02, 0.02))
    return mesh.positions.copy(), mesh.tetrahedra.copy()


def expect_refusal(positions, tetrahedra, message):
    with pytest.raises(MeshError, match=message):
        checked(TetrahedralMesh(positions, tetrahedra))


def test_a_sound_mesh_passes_unchanged():
    mesh = block()
    result = checked(mesh)
    assert result.warnings == ()
    assert np.array_equal(result.mesh.positions, mesh.positions)
    assert np.array_equal(result.mesh.tetrahedra, mesh.tetrahedra)
    assert np.array_equal(result.origin, np.arange(len(mesh.positions)))


def test_other_types_of_numbers_are_converted():
    positions, tetrahedra = sound_block()
    mesh = checked(TetrahedralMesh(positions.astype("f4"), tetrahedra.astype("u4"))).mesh
    assert mesh.positions.dtype == np.float64
    assert mesh.tetrahedra.dtype == np.int64


def with_node(node, place):
    """Return the sound block with one node elsewhere [m]."""
    positions, tetrahedra = sound_block()
    positions[node] = place
    return positions, tetrahedra


def with_corner(index):
    """Return the sound block with another node as the third corner of tetrahedron 5."""
    positions, tetrahedra = sound_block()
    tetrahedra[5, 2] = index
    return positions, tetrahedra


def with_more(corners, nodes):
    """Return the sound block with one more tetrahedron, and with more nodes [m]."""
    positions, tetrahedra = sound_block()
    nodes = np.reshape(nodes, (-1, 3))
    return np.concatenate([positions, nodes]), np.concatenate([tetrahedra, [corners]])


SOUND, FOURTH = sound_block(), sound_block()[1][3]
FLAT = 0.01 * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]])
ABOVE, BELOW = [0.002, 0.002, 0.02], [0.002, 0.002, -0.02]
ONE = np.array([[0, 1, 2, 3]])

REFUSED = [  # positions, tetrahedra, and the message
    *((*with_node(3, x), "node 3 has a coordinate that is NaN or inf") for x in (np.nan, -np.inf)),
    *(
        (*with_corner(i), f"tetrahedron 5 has an index out of range, such as {i}")
        for i in (27, -1, 2**62)
    ),
    (*with_corner(SOUND[1][5, 1]), "tetrahedron 5 has a repeated node"),
    *(
        (*with_more(FOURTH[order], []), "duplicate tetrahedra: 3 and 48")
        for order in ([0, 1, 2, 3], [1, 0, 2, 3], [3, 1, 0, 2])
    ),
    (*with_more([27, 28, 29, 30], FLAT), "1 flat tetrahedra, the worst: 48 "),
    (*with_node(SOUND[1][0, 1], SOUND[0][SOUND[1][0, 0]]), "flat tetrahedra, the worst: 0 "),
    (
        np.concatenate([CORNERS, [ABOVE, BELOW]]),
        np.array([[0, 1, 2, 3], [0, 1, 2, 4], [0, 2, 1, 5]]),
        r"face \[0, 1, 2\] is shared by 3 tetrahedra, 0, 1, 2",
    ),
    (
        np.concatenate([CORNERS, [ABOVE]]),
        np.array([[0, 1, 2, 3], [0, 1, 2, 4]]),
        "tetrahedra 0 and 1 overlap",
    ),
    (CORNERS, ONE[:0], "no tetrahedra"),
    (CORNERS[:, :2], ONE, "positions are float64 of shape"),
    (CORNERS, ONE[:, :3], "tetrahedra are int64 of shape"),
    (CORNERS, ONE.astype(float), "whole numbers"),
    (1e6 * SOUND[0], SOUND[1], "over 1000 m: millimetres"),
    (1e-4 * SOUND[0], SOUND[1], "under 1e-05 m"),
]


@pytest.mark.parametrize(("positions", "tetrahedra", "message"), REFUSED, ids=str)
def test_a_broken_mesh_is_refused_by_what_is_wrong_with_it(positions, tetrahedra, message):
    expect_refusal(positions, tetrahedra, message)


@pytest.mark.parametrize("name", ["4", "4, 17", "0, 2, 4, 6, 8, ...", "all but 4", "all"])
def test_tetrahedra_of_a_sound_body_are_reordered_whichever_way_they_wind(name):
    positions, tetrahedra = sound_block()
    all_48 = np.arange(48)
    inverted = {
        "4": all_48 == 4,
        "4, 17": np.isin(all_48, (4, 17)),
        "0, 2, 4, 6, 8, ...": all_48 % 2 == 0,
        "all but 4": all_48 != 4,
        "all": all_48 >= 0,
    }[name]
    tetrahedra[inverted] = tetrahedra[inverted][:, [1, 0, 2, 3]]
    result = checked(TetrahedralMesh(positions, tetrahedra))
    assert (signed_volumes(*result.mesh[:2]) > 0.0).all()
    assert result.warnings == (
        f"inverted tetrahedra (negative volumes): {name} ({inverted.sum()} of 48); reordered "
        "their nodes",
    )


def test_a_tetrahedron_that_is_folded_over_its_neighbours_is_refused():
    positions, tetrahedra = block((4, 4, 4), (0.04, 0.04, 0.04))[:2]
    positions = positions.copy()
    middle = np.flatnonzero((positions == 0.02).all(axis=1))[0]
    positions[middle, 0] += 0.011  # past the face of the cell beside
    assert 0.0 < (signed_volumes(positions, tetrahedra) < 0.0).mean() < 0.05
    expect_refusal(positions, tetrahedra, "overlap: both lie on the same side")


def test_a_body_of_twenty_metres_gets_a_hint_at_the_scale():
    positions, tetrahedra = sound_block()
    result = checked(TetrahedralMesh(1000.0 * positions, tetrahedra))
    assert result.warnings == ("extent 20 m: millimetres? use --scale 0.001",)


def test_unused_nodes_are_dropped_with_a_warning_and_the_rest_keep_their_origin():
    positions, tetrahedra = sound_block()
    result = checked(TetrahedralMesh(np.concatenate([CORNERS[:2], positions]), tetrahedra + 2))
    assert np.array_equal(result.mesh.positions, positions)
    assert np.array_equal(result.mesh.tetrahedra, tetrahedra)
    assert np.array_equal(result.origin, np.arange(2, 29))
    assert "dropped 2 nodes that no tetrahedron uses, the first 0, 1" in result.warnings[0]


@pytest.mark.parametrize(
    ("other", "n_split"),
    [
        ([[0.0, 0, -1], [-1, 0, 0], [0, -1, 0]], 1),  # shares node 0
        ([[1.0, 0, 0], [0.5, -1, 0], [0.5, 0, -1]], 2),  # shares edge 01
    ],
)
def test_tetrahedra_connected_only_by_a_node_or_an_edge_are_separated(other, n_split):
    other = 0.01 * np.array(other)
    is_edge = n_split == 2
    positions = np.concatenate([CORNERS, other[1:] if is_edge else other])
    second = [0, 1, 4, 5] if is_edge else [0, 4, 5, 6]
    tetrahedra = np.array([[0, 1, 2, 3], second])
    if signed_volumes(positions, tetrahedra)[1] < 0.0:
        tetrahedra[1] = tetrahedra[1, [0, 1, 3, 2]]
    result = checked(TetrahedralMesh(positions, tetrahedra))
    assert len(result.mesh.positions) == 8
    assert not set(result.mesh.tetrahedra[0]) & set(result.mesh.tetrahedra[1])
    assert np.array_equal(result.mesh.positions, positions[result.origin])
    assert f"split {n_split} node" in result.warnings[0]
    assert "in 2 pieces" in result.warnings[1]


def test_labels_stay_with_their_tetrahedra_through_repairs():
    positions, tetrahedra = sound_block()
    labels, names = np.arange(48) % 3, {1: "vessel"}
    turned = np.where((labels == 2)[:, None], tetrahedra[:, [1, 0, 2, 3]], tetrahedra)
    given = TetrahedralMesh(np.concatenate([CORNERS, positions]), turned + 4, labels, names)
    mesh = checked(given).mesh
    assert np.array_equal(np.sort(mesh.tetrahedra), np.sort(tetrahedra))
    assert np.array_equal(mesh.labels, labels)
    assert mesh.label_names == names


@pytest.mark.parametrize(
    ("labels", "names", "message"),
    [
        (np.zeros(47, dtype=int), {}, "one for each of the 48 tetrahedra"),
        (np.zeros(48), {}, "labels are float64"),
        (np.arange(48) - 1, {}, "tetrahedron 0 has the label -1"),
        (np.arange(48) + 2**31, {}, "tetrahedron 0 has the label 2147483648"),
        (np.arange(48), {-1: "vessel"}, "label_names has 'vessel' for -1"),
        (np.arange(48), {1: 2}, "label_names has 2 for 1"),
    ],
)
def test_labels_that_are_none_are_refused(labels, names, message):
    with pytest.raises(MeshError, match=message):
        checked(TetrahedralMesh(*sound_block(), labels, names))


def test_slivers_are_allowed_with_a_warning():
    positions, tetrahedra = sound_block()
    (warning,) = checked(TetrahedralMesh(positions * [1, 1, 1e-3], tetrahedra)).warnings
    assert warning.startswith("48 slivers")


def test_warnings_and_errors_give_the_name_of_the_mesh(caplog):
    positions, tetrahedra = sound_block()
    with caplog.at_level(logging.WARNING, logger="tissue"):
        checked(TetrahedralMesh(1000.0 * positions, tetrahedra), "liver.msh")
    assert caplog.messages == ["liver.msh: extent 20 m: millimetres? use --scale 0.001"]
    with pytest.raises(MeshError, match=r"^liver\.msh: there are no tetrahedra"):
        checked(TetrahedralMesh(positions, tetrahedra[:0]), "liver.msh")


def test_quality_is_one_for_a_regular_tetrahedron_of_any_size():
    regular = np.array([[1.0, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]])
    for size in (1e-4, 1.0, 100.0):
        assert abs(quality(size * regular, np.array([[0, 1, 2, 3]]))) == pytest.approx(1.0)


def test_components_are_numbered_by_their_lowest_vertices():
    n, labels = components(6, np.array([[5, 1], [0, 2], [2, 4]]))
    assert n == 3
    assert labels.tolist() == [0, 1, 0, 2, 0, 1]


def test_a_mesh_that_needs_repair_is_refused_where_it_must_not_change():
    positions, tetrahedra = sound_block()
    labels = np.arange(48)
    assert expect_sound(TetrahedralMesh(positions, tetrahedra, labels)).labels is labels
    expect_sound(TetrahedralMesh(1000.0 * positions, tetrahedra))  # implausible, but not wrong
    for broken in (
        TetrahedralMesh(np.concatenate([positions, CORNERS]), tetrahedra),
        TetrahedralMesh(positions, tetrahedra[:, [1, 0, 2, 3]]),
        TetrahedralMesh(positions, tetrahedra[[0, 0]]),
    ):
        with pytest.raises(MeshError):
            expect_sound(broken)
