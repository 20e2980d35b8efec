"""Labels and cells of files, against what meshio reads in the same file and writes of the same."""

import itertools
import logging
import re

import meshio
import numpy as np
import pytest

from tests.tissue.io import mesh_writers as write
from tissue import MeshError, TetrahedralMesh, block, boundary_faces, read_mesh
from tissue.io.label_arrays import LABEL_ARRAYS, as_labels, label_array
from tissue.io.mesh_io import read_mesh_file
from tissue.mesh.validation import signed_volumes

PLAIN = block((2, 2, 2), (0.03, 0.02, 0.01))
NAMES = {2: "vessel", 5: "wall of it"}
LABELLED = PLAIN._replace(
    labels=np.arange(48) % 3 * 2 + (np.arange(48) % 3 == 2), label_names=NAMES
)
"""A block with the labels 0, 2 and 5."""

NAMED = {
    **{f"2 {order}.msh": write.gmsh_2(LABELLED, order) for order in ("", "<", ">")},
    **{f"4 {order}.msh": write.gmsh_4(LABELLED, order) for order in ("", "<", ">")},
}
NUMBERED = {
    "1.msh": write.gmsh_1(LABELLED),
    **{
        f"{version} {is_binary}.vtk": write.vtk_legacy(LABELLED, version, is_binary)
        for version in ("2.0", "5.1")
        for is_binary in (False, True)
    },
    **{f"{form}.vtu": write.vtu(LABELLED, form) for form in ("ascii", "binary", "appended")},
    "text.mesh": write.medit(LABELLED),
    **{f"{version}.meshb": write.medit_binary(LABELLED, version, "<") for version in (2, 3, 4)},
}


def by_place(mesh):
    """Return labels by the middles of tetrahedra: the order of these may differ."""
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1).round(9)
    return dict(zip(map(tuple, middles.tolist()), mesh.labels.tolist(), strict=True))


@pytest.mark.parametrize("name", [*NAMED, *NUMBERED])
def test_labels_and_names_come_with_the_tetrahedra(name, tmp_path):
    (tmp_path / name).write_bytes({**NAMED, **NUMBERED}[name])
    mesh = read_mesh(tmp_path / name)
    assert by_place(mesh) == by_place(LABELLED)
    assert mesh.label_names == (NAMES if name in NAMED else {})


@pytest.mark.parametrize(
    "name",
    [
        *("2 .msh", "2.0 False.vtk", "2.0 True.vtk", "5.1 False.vtk", "ascii.vtu", "binary.vtu"),
        *("text.mesh", "2.meshb"),
    ],
)
def test_labels_are_those_that_meshio_reads_in_the_same_file(name, tmp_path):
    (tmp_path / name).write_bytes({**NAMED, **NUMBERED}[name])
    read = meshio.read(tmp_path / name)
    mesh = read_mesh(tmp_path / name)
    (data,) = (v for k, v in read.cell_data.items() if k.lower() in LABEL_ARRAYS[:-1])
    cells = [(b.data, d) for b, d in zip(read.cells, data, strict=True) if b.type == "tetra"]
    their = TetrahedralMesh(
        read.points, np.concatenate([c for c, _ in cells]), np.concatenate([d for _, d in cells])
    )
    assert by_place(mesh) == by_place(their)


@pytest.mark.parametrize(
    ("file_format", "suffix", "key"),
    [
        ("gmsh22", "msh", "gmsh:physical"),
        ("medit", "mesh", "medit:ref"),
        ("medit", "meshb", "medit:ref"),
        ("nastran", "bdf", "nastran:ref"),
        ("tetgen", "node", "tetgen:ref"),
        ("vtk", "vtk", "material"),
        ("vtu", "vtu", "Region"),
    ],
)
def test_labels_that_meshio_writes_are_read(file_format, suffix, key, tmp_path):
    labels = LABELLED.labels + 1
    data = {key: [labels]} | ({"gmsh:geometrical": [labels]} if "gmsh" in key else {})
    mesh = meshio.Mesh(PLAIN.positions, [("tetra", PLAIN.tetrahedra)], cell_data=data)
    meshio.write(tmp_path / f"mesh.{suffix}", mesh, file_format=file_format)
    read = read_mesh(tmp_path / f"mesh.{suffix}")
    np.testing.assert_array_equal(read.labels, labels)
    np.testing.assert_array_equal(read.tetrahedra, PLAIN.tetrahedra)
    np.testing.assert_allclose(read.positions, PLAIN.positions, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("suffix", [".node", ".ele"])
def test_the_two_files_of_tetgen_are_read_by_either_name(suffix, first, tmp_path):
    for each, data in zip((".node", ".ele"), write.tetgen(LABELLED, first), strict=True):
        (tmp_path / f"mesh{each}").write_bytes(data)
    mesh = read_mesh(tmp_path / f"mesh{suffix}")
    np.testing.assert_array_equal(mesh.tetrahedra, PLAIN.tetrahedra)
    np.testing.assert_array_equal(mesh.positions, PLAIN.positions)
    np.testing.assert_array_equal(mesh.labels, LABELLED.labels)
    (tmp_path / f"mesh{'.ele' if suffix == '.node' else '.node'}").unlink()
    with pytest.raises(MeshError, match="no such file"):
        read_mesh(tmp_path / f"mesh{suffix}")


def test_numbers_of_tetgen_that_do_not_agree_are_refused(tmp_path):
    (tmp_path / "mesh.node").write_bytes(write.tetgen(LABELLED, 0)[0])
    (tmp_path / "mesh.ele").write_bytes(write.tetgen(LABELLED, 1)[1])
    with pytest.raises(MeshError, match="expected numbers from 0 on, as those of the nodes, fou"):
        read_mesh(tmp_path / "mesh.node")


@pytest.mark.parametrize("form", ["free", "small", "large"])
def test_nastran_is_read_in_every_form_of_field_as_meshio_reads_it(form, tmp_path):
    (tmp_path / "mesh.bdf").write_bytes(write.nastran(LABELLED, form))
    mesh = read_mesh(tmp_path / "mesh.bdf")
    np.testing.assert_array_equal(mesh.labels, LABELLED.labels + 1)
    np.testing.assert_array_equal(mesh.tetrahedra, PLAIN.tetrahedra)
    their = meshio.read(tmp_path / "mesh.bdf")
    np.testing.assert_allclose(mesh.positions, their.points, rtol=0.0, atol=1e-12)
    if form != "large":  # of which meshio reads no solid elements
        np.testing.assert_array_equal(mesh.tetrahedra, their.cells_dict["tetra"])


def test_sets_of_abaqus_are_labels_with_their_names(tmp_path):
    (tmp_path / "mesh.inp").write_bytes(write.abaqus(LABELLED))
    mesh = read_mesh(tmp_path / "mesh.inp")
    expected = np.select([LABELLED.labels == 2, LABELLED.labels == 5], [1, 2])
    np.testing.assert_array_equal(mesh.labels, expected)
    assert mesh.label_names == {1: "vessel", 2: "wall of it"}


def test_sections_say_which_sets_of_abaqus_are_labels_and_a_smaller_set_counts(tmp_path, caplog):
    data = write.abaqus(PLAIN).decode().replace("*MATERIAL", "*ELSET, ELSET=ALL, GENERATE\n1, 48\n"
        "*ELSET, ELSET=Fat\n1, 2, 3,\n4\n*ELSET, ELSET=odd\n Fat,\n*ELSET, ELSET=probe\n7\n"
        "*SOLID SECTION, ELSET=all, MATERIAL=a\n1.\n*SOLID SECTION, ELSET=ODD, MATERIAL=b\n1.\n"
        "*MATERIAL")  # fmt: skip
    (tmp_path / "mesh.inp").write_text(data)
    with caplog.at_level(logging.WARNING, logger="tissue"):
        mesh = read_mesh(tmp_path / "mesh.inp")
    np.testing.assert_array_equal(mesh.labels, np.where(np.arange(48) < 4, 2, 1))
    assert mesh.label_names == {1: "ALL", 2: "odd"}
    assert "4 elements are in several sets: the smallest is the label" in caplog.text


@pytest.mark.parametrize(
    ("suffix", "old", "new", "message"),
    [
        ("inp", "*HEADING", "*INCLUDE, INPUT=a.inp\n*HEADING", "in another file"),
        ("inp", "*ELASTIC", "*NGEN", "write the model out flat"),
        ("inp", "*Element, type=S3\n9001,", "*Element, type=S3\n1,", "element 1 occurs twice"),
        ("inp", "TYPE=C3D4", "TYPE=S4", "only a surface"),
        ("bdf", "CTRIA3,9001", "CTRIA3,1", "element 1 occurs twice"),
        ("bdf", "GRID,7,,", "GRID,7,4,", "coordinates in the system '4'"),
        ("bdf", "GRID,7,,0.0", "GRID,7,,O.0", "expected a coordinate, found 'O.0'"),
        ("bdf", "GRID,8,", "GRID,7,", "node 7 occurs twice"),
        ("mesh", "Dimension 3", "Dimension 2", "expected dimension 3, found 2"),
        ("mesh", "Dimension 3", "Dimension 1e999", "expected whole numbers, found inf"),
        ("mesh", "Tetrahedra\n48", "Tetrahedra\n47", "expected 235 numbers, found 240"),
    ],
)
def test_what_cannot_be_read_is_refused_by_what_it_is(suffix, old, new, message, tmp_path):
    writers = {"inp": write.abaqus, "mesh": write.medit}
    data = writers.get(suffix, lambda mesh: write.nastran(mesh, "free"))(PLAIN).decode()
    assert data.count(old) == 1
    (tmp_path / f"mesh.{suffix}").write_text(data.replace(old, new))
    with pytest.raises(MeshError, match=message):
        read_mesh(tmp_path / f"mesh.{suffix}")


@pytest.mark.parametrize(
    ("suffix", "old", "new", "said"),
    [
        ("inp", "*ELEMENT, TYPE", "*ELEMENTS, TYPE", None),
        (
            "inp",
            "*ELASTIC",
            "*ELASTICK",
            r"\*ELASTICK of line 84 is not known: its lines are left",
        ),
        ("bdf", "CTETRA,5,", "CTETRO,5,", "1 entries 'CTETRO' are not known: left out"),
        ("bdf", "ENDDATA", "", "the file ends without ENDDATA"),
        ("mesh", "Corners\n", "Cornets\n", "the section 'Cornets' is left out"),
        ("mesh", "\nEnd", "", "the file ends without the word End"),
    ],
)
def test_what_is_left_out_is_said(suffix, old, new, said, tmp_path, caplog):
    writers = {"inp": write.abaqus, "mesh": write.medit}
    data = writers.get(suffix, lambda mesh: write.nastran(mesh, "free"))(PLAIN).decode()
    (tmp_path / f"mesh.{suffix}").write_text(data.replace(old, new))
    if said is None:
        with pytest.raises(MeshError, match="only a surface"):
            read_mesh(tmp_path / f"mesh.{suffix}")
        return
    read_mesh(tmp_path / f"mesh.{suffix}")
    assert re.search(said, caplog.text)


# ------------------------------------------------------------------ which array is that of labels


def test_the_first_name_of_the_list_counts_whatever_its_case(tmp_path, caplog):
    assert label_array(["stress", "Material", "REGION", "gmsh:geometrical"]) == "REGION"
    assert label_array(["stress", "piece"]) is None
    data = {"material": [np.arange(48) % 2], "label": [np.arange(48) % 4]}
    mesh = meshio.Mesh(PLAIN.positions, [("tetra", PLAIN.tetrahedra)], cell_data=data)
    mesh.write(tmp_path / "a.vtu")
    np.testing.assert_array_equal(read_mesh(tmp_path / "a.vtu").labels, np.arange(48) % 4)
    assert "labels are those of 'label', not of 'material'" in caplog.text


@pytest.mark.parametrize("values", [[0.0, 1.5], [-1, 0], [np.nan, 1.0], [0, 2**31]])
def test_numbers_that_are_no_labels_are_none(values):
    assert as_labels(np.array(values)) is None
    np.testing.assert_array_equal(as_labels(np.array([0.0, 3.0])), [0, 3])


def test_data_that_are_no_labels_are_left_out_with_a_word(tmp_path, caplog):
    data = {"material": [np.linspace(0.0, 1.0, 48)]}
    meshio.Mesh(PLAIN.positions, [("tetra", PLAIN.tetrahedra)], cell_data=data).write(
        tmp_path / "a.vtu"
    )
    assert read_mesh(tmp_path / "a.vtu").labels is None
    assert "the cell data 'material' are no labels" in caplog.text


@pytest.mark.parametrize("suffix", ["vtk", "vtu"])
def test_labels_of_tetrahedra_are_kept_whatever_the_faces_beside_them_have(tmp_path, suffix):
    cells = [("triangle", PLAIN.tetrahedra[:5, :3]), ("tetra", PLAIN.tetrahedra)]
    data = {"medit:ref": [np.full(5, -1), np.arange(48) % 3]}
    meshio.Mesh(PLAIN.positions, cells, cell_data=data).write(tmp_path / f"a.{suffix}")
    np.testing.assert_array_equal(read_mesh(tmp_path / f"a.{suffix}").labels, np.arange(48) % 3)


# ------------------------------------------------------------------ other cells than tetrahedra


def grid(n):
    """Return nodes, numbered at random, and hexahedra of a grid of n cells along each edge."""
    axis = np.linspace(0.0, 0.03, n + 1)
    points = np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1).reshape(-1, 3)
    number = np.arange((n + 1) ** 3).reshape((n + 1,) * 3)
    x, y, z = (each.ravel() for each in np.meshgrid(*[np.arange(n)] * 3, indexing="ij"))
    corners = [
        (0, 0, 0),
        (1, 0, 0),
        (1, 1, 0),
        (0, 1, 0),
        (0, 0, 1),
        (1, 0, 1),
        (1, 1, 1),
        (0, 1, 1),
    ]
    cells = np.stack([number[x + i, y + j, z + k] for i, j, k in corners], axis=1)
    place = np.random.default_rng(3).permutation(len(points))
    return points[np.argsort(place)], place[cells]


def mixed(n):
    """Return the grid with two columns of its cells as wedges, and one cell as six pyramids."""
    points, cells = grid(n)
    in_columns = np.isin(np.arange(n**3) // n, (1, n + 1))
    wedges = cells[in_columns]
    halves = [wedges[:, [0, 1, 2, 4, 5, 6]], wedges[:, [0, 2, 3, 4, 6, 7]]]
    kept = cells[~in_columns]
    middle = points[kept[0]].mean(axis=0)
    sides = [(0, 3, 2, 1), (4, 5, 6, 7), (0, 1, 5, 4), (1, 2, 6, 5), (2, 3, 7, 6), (3, 0, 4, 7)]
    pyramids = [[*kept[0, list(side)], len(points)] for side in sides]
    return np.vstack([points, middle]), {
        "hexahedron": kept[1:],
        "wedge": np.concatenate(halves),
        "pyramid": np.array(pyramids),
    }


@pytest.mark.parametrize(
    ("file_format", "suffix"),
    [
        *(("gmsh22", "msh"), ("vtk", "vtk"), ("vtu", "vtu"), ("medit", "mesh")),
        *(("abaqus", "inp"), ("nastran", "bdf")),
    ],
)
def test_hexahedra_wedges_and_pyramids_are_divided_without_a_gap(
    file_format, suffix, tmp_path, caplog
):
    points, cells = mixed(3)
    if suffix in ("inp", "bdf"):  # meshio writes no pyramids there
        points, hexahedra = grid(3)
        cells = {"hexahedron": hexahedra, "wedge": np.zeros((0, 6), int), "pyramid": []}
    meshio.Mesh(points, [(k, c) for k, c in cells.items() if len(c)]).write(
        tmp_path / f"mesh.{suffix}", file_format=file_format
    )
    mesh = read_mesh(tmp_path / f"mesh.{suffix}")
    volumes = signed_volumes(mesh.positions, mesh.tetrahedra)
    assert volumes.min() > 0.0
    assert volumes.sum() == pytest.approx(0.03**3, rel=1e-6)
    n = {name: len(each) for name, each in cells.items()}
    assert len(mesh.tetrahedra) == 6 * n["hexahedron"] + 3 * n["wedge"] + 2 * n["pyramid"]
    faces = boundary_faces(mesh.tetrahedra)
    a, b, c = (mesh.positions[faces[:, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(6 * 0.03**2, rel=1e-6)  # none inside: all diagonals agree
    assert "cracks" not in caplog.text


def test_sides_that_are_divided_otherwise_are_said_to_be_cracks(tmp_path, caplog):
    points, cells = grid(2)
    first = cells[0]  # its side above has a neighbour
    is_even = first[[4, 5, 6, 7]].argmin() % 2 == 0
    other_way = ((0, 1, 3), (1, 2, 3)) if is_even else ((0, 1, 2), (0, 2, 3))
    halves = np.array([[*half, *(4 + k for k in half)] for half in other_way])
    meshio.Mesh(points, [("hexahedron", cells[1:]), ("wedge", first[halves])]).write(
        tmp_path / "mesh.vtu"
    )
    read_mesh(tmp_path / "mesh.vtu")
    assert "the body has cracks there" in caplog.text


def test_a_voxel_is_a_hexahedron_whose_corners_are_in_another_order(tmp_path):
    points = np.array(list(itertools.product((0.0, 0.01), repeat=3)))[:, ::-1]
    cube = meshio.Mesh(points, [("hexahedron", np.arange(8)[None])])
    cube.write(tmp_path / "mesh.vtk", file_format="vtk42", binary=False)
    text = (tmp_path / "mesh.vtk").read_text()
    assert text.count("CELL_TYPES 1\n12") == 1
    (tmp_path / "mesh.vtk").write_text(text.replace("CELL_TYPES 1\n12", "CELL_TYPES 1\n11"))
    mesh = read_mesh(tmp_path / "mesh.vtk")
    assert signed_volumes(mesh.positions, mesh.tetrahedra).sum() == pytest.approx(1e-6)


def second_order(bulge):
    """Return the block with a node between each two, moved by up to `bulge` [m]."""
    pairs = [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)]  # the order of VTK, Abaqus, Nastran
    ends = np.sort(PLAIN.tetrahedra[:, pairs].reshape(-1, 2), axis=1)
    edges, index = np.unique(ends, axis=0, return_inverse=True)
    middles = PLAIN.positions[edges].mean(axis=1)
    middles[0, 0] += bulge
    cells = np.column_stack((PLAIN.tetrahedra, len(PLAIN.positions) + index.reshape(-1, 6)))
    return np.vstack([PLAIN.positions, middles]), cells


@pytest.mark.parametrize(
    ("file_format", "suffix"),
    [
        *(("gmsh22", "msh"), ("vtk", "vtk"), ("vtu", "vtu")),
        *(("abaqus", "inp"), ("nastran", "bdf")),
    ],
)
def test_tetrahedra_of_second_order_are_straightened_with_a_word(
    file_format, suffix, tmp_path, caplog
):
    points, cells = second_order(0.002)
    triangles = np.array([[0, 1, 2, 4, 5, 6]])
    skin = cells[:5][:, triangles[0]]
    meshio.Mesh(points, [("tetra10", cells), ("triangle6", skin)]).write(
        tmp_path / f"mesh.{suffix}", file_format=file_format
    )
    mesh = read_mesh(tmp_path / f"mesh.{suffix}")
    np.testing.assert_array_equal(mesh.tetrahedra, PLAIN.tetrahedra)
    np.testing.assert_allclose(mesh.positions, PLAIN.positions, rtol=0.0, atol=1e-9)
    assert "48 tetrahedra with 10 nodes straightened: their 4 corners are used" in caplog.text
    assert "lay up to 0.002 off their middle" in caplog.text


def test_a_side_of_a_cell_is_left_out_and_what_may_be_a_lost_tetrahedron_is_refused(tmp_path):
    points, cells = grid(2)
    side = [("quad", cells[:, [0, 1, 2, 3]])]
    meshio.Mesh(points, [("hexahedron", cells), *side]).write(tmp_path / "mesh.vtu")
    found = read_mesh_file(tmp_path / "mesh.vtu")
    assert found.cells == {"hexahedra": 8, "quadrangles": 8}
    assert len(found.mesh.tetrahedra) == 48
    lost = [("hexahedron", cells[1:]), ("quad", cells[:1, [0, 1, 2, 4]])]
    meshio.Mesh(points, lost).write(tmp_path / "lost.vtu")
    with pytest.raises(MeshError, match="cell 7, one of the quadrangles, has 4 nodes"):
        read_mesh(tmp_path / "lost.vtu")


def test_a_collapsed_hexahedron_makes_fewer_tetrahedra_with_a_word(tmp_path, caplog):
    points = 0.01 * np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1]])
    wedge = [("hexahedron", np.array([[0, 1, 2, 2, 3, 4, 5, 5]]))]
    meshio.Mesh(points, wedge).write(tmp_path / "mesh.vtu")
    mesh = read_mesh(tmp_path / "mesh.vtu")
    assert len(mesh.tetrahedra) == 3
    assert signed_volumes(mesh.positions, mesh.tetrahedra).sum() == pytest.approx(0.5e-6)
    assert "1 of the hexahedra have a node twice: taken as collapsed" in caplog.text


def test_volumes_without_physical_groups_are_labels_by_their_numbers(tmp_path):
    data = write.gmsh_2(LABELLED).replace(b" 2 0 1 ", b" 2 0 7 ")
    for label in (2, 5):
        data = data.replace(b" 4 2 %d 1 " % label, b" 4 2 0 %d " % label)
    (tmp_path / "a.msh").write_bytes(data)
    mesh = read_mesh(tmp_path / "a.msh")
    np.testing.assert_array_equal(mesh.labels, np.where(LABELLED.labels, LABELLED.labels, 7))
    assert mesh.label_names == {}


def test_cells_of_no_label_but_0_have_none(tmp_path):
    (tmp_path / "a.mesh").write_bytes(write.medit(PLAIN))
    assert read_mesh(tmp_path / "a.mesh").labels is None
