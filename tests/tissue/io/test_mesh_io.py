import os
import socket

import meshio
import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.io import mesh_writers
from tests.tissue.io import mesh_writers as write
from tissue import Snapshot, TetrahedralMesh, Tissue, block, read_mesh, write_mesh, write_vtu
from tissue.boundary_conditions import side_nodes
from tissue.io import mesh_io
from tissue.io.mesh_io import renumbered
from tissue.mesh.mesh_arrays import MeshError

BLOCK = block((2, 1, 2), (0.03, 0.02, 0.01))

FILES = {
    "gmsh 1.0.msh": write.gmsh_1(BLOCK),
    **{f"gmsh 2.2 {o}.msh": write.gmsh_2(BLOCK, o) for o in ("", "<", ">")},
    **{f"gmsh 4.1 {o}.msh": write.gmsh_4(BLOCK, o) for o in ("", "<", ">")},
    **{
        f"vtk {version} {'binary' if b else 'text'}.vtk": write.vtk_legacy(BLOCK, version, b)
        for version in ("2.0", "5.1")
        for b in (False, True)
    },
    "medit.mesh": write.medit(BLOCK),
    **{f"medit {v} {o}.meshb": write.medit_binary(BLOCK, v, o) for v in (2, 3, 4) for o in "<>"},
    "text.vtu": write.vtu(BLOCK, "ascii"),
    **{
        f"{form} {order} {header} {'zlib' if z else 'plain'}.vtu": write.vtu(
            BLOCK, form, order, header, z
        )
        for form in ("binary", "appended")
        for order, header, z in (
            ("<", "UInt64", False),
            ("<", "UInt64", True),
            (">", "UInt32", True),
        )
    },
    "appended base64.vtu": write.vtu(BLOCK, "appended", appended_is_raw=False),
    "appended base64 zlib.vtu": write.vtu(
        BLOCK, "appended", is_compressed=True, appended_is_raw=False
    ),
}

UNCOUNTED = {
    "abaqus.inp": write.abaqus(BLOCK),
    **{f"nastran {form}.bdf": write.nastran(BLOCK, form) for form in ("free", "large")},
}
"""Files of formats that do not say how much is in them: a loss of whole lines does not show."""


def refusal(path):
    """Return the message of the error that `path` causes."""
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    message = str(caught.value)
    assert message.startswith(f"{path}: ")
    assert "\n" not in message
    return message


def refusal_of(folder, name, data):
    path = folder / name
    path.write_bytes(data)
    return refusal(path)


@pytest.mark.parametrize("name", [*FILES, *UNCOUNTED])
def test_every_format_reproduces_the_mesh_to_the_last_bit(name, tmp_path):
    (tmp_path / name).write_bytes({**FILES, **UNCOUNTED}[name])
    mesh = read_mesh(tmp_path / name)
    assert np.array_equal(mesh.positions, BLOCK.positions)
    assert np.array_equal(mesh.tetrahedra, BLOCK.tetrahedra)


def test_single_precision_and_windows_line_ends_are_read_too(tmp_path):
    (tmp_path / "f.vtk").write_bytes(write.vtk_legacy(BLOCK, "2.0", True, "float"))
    assert np.array_equal(read_mesh(tmp_path / "f.vtk").positions, BLOCK.positions.astype("f4"))
    for name in ("gmsh 1.0.msh", "gmsh 2.2 .msh", "gmsh 4.1 .msh", "vtk 2.0 text.vtk"):
        (tmp_path / name).write_bytes(FILES[name].replace(b"\n", b"\r\n"))
        assert np.array_equal(read_mesh(tmp_path / name).tetrahedra, BLOCK.tetrahedra)


@pytest.mark.parametrize("file_format", ["gmsh22", "gmsh", "vtk42", "vtk51", "vtu"])
@pytest.mark.parametrize("binary", [False, True])
def test_what_meshio_writes_is_read(file_format, binary, tmp_path):
    path = tmp_path / f"mesh.{'msh' if 'gmsh' in file_format else file_format[:3]}"
    mesh = meshio.Mesh(BLOCK.positions, [("tetra", BLOCK.tetrahedra)])
    meshio.write(path, mesh, file_format=file_format, binary=binary)
    assert np.array_equal(read_mesh(path).tetrahedra, BLOCK.tetrahedra)
    assert np.allclose(read_mesh(path).positions, BLOCK.positions, rtol=0.0, atol=1e-12)


def test_the_scale_brings_millimetres_to_metres(tmp_path):
    in_millimetres = BLOCK._replace(positions=1000.0 * BLOCK.positions)
    (tmp_path / "mm.msh").write_bytes(write.gmsh_2(in_millimetres))
    assert read_mesh(tmp_path / "mm.msh", 0.001).positions == pytest.approx(BLOCK.positions)


@pytest.mark.parametrize("scale", [0.0, -1.0, float("nan"), float("inf")])
def test_a_scale_that_is_not_positive_is_refused(scale, tmp_path):
    with pytest.raises(ValueError, match="scale is"):
        read_mesh(tmp_path / "any.msh", scale)


# ------------------------------------------------------------------ files without a mesh


def test_a_missing_file_a_directory_and_an_empty_file_are_refused(tmp_path):
    assert "no such file" in refusal(tmp_path / "missing.msh")
    (tmp_path / "folder.msh").mkdir()
    assert "directory" in refusal(tmp_path / "folder.msh")
    assert "empty" in refusal_of(tmp_path, "empty.vtk", b"")
    assert "empty" in refusal_of(tmp_path, "blank.vtk", b" \n \n")


def test_a_pipe_is_refused_without_waiting(tmp_path):
    os.mkfifo(tmp_path / "pipe.msh")
    assert "pipe" in refusal(tmp_path / "pipe.msh")
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(tmp_path / "s.msh"))
        assert "pipe" in refusal(tmp_path / "s.msh")


def test_a_file_too_large_is_refused_before_it_is_read(tmp_path):
    with (tmp_path / "large.vtu").open("wb") as file:
        file.truncate(2**31)  # sparse: takes no room on the disk
    assert "expected at most 2147483647 bytes, found 2147483648" in refusal(tmp_path / "large.vtu")


@pytest.mark.parametrize("suffix", ["", ".txt"])
def test_an_unknown_suffix_is_refused_with_the_known_ones(suffix, tmp_path):
    message = refusal_of(tmp_path, "mesh" + suffix, b"hello")
    assert ".msh, .vtk, .vtu" in message
    assert f"`meshio convert mesh{suffix} mesh.vtu`" in message


@pytest.mark.parametrize("suffix", [".stl", ".OBJ", ".ply"])
def test_a_surface_file_is_refused_with_advice(suffix, tmp_path):
    assert "only a surface" in refusal_of(tmp_path, "organ" + suffix, b"solid organ")


@pytest.mark.parametrize("suffix", [".msh", ".vtk", ".vtu"])
@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"<!DOCTYPE html><html><body>404</body></html>", "a web page"),
        (b"\n<html>\n<body>Sign in</body></html>", "a web page"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "Git LFS"),
        (b"\x1f\x8b\x08\x00\x00\x00\x00\x00", "compressed"),
        (b"hello", "expected"),
        (bytes(range(256)) * 4, "expected"),
        (b"\x00" * 1000, "expected"),
    ],
)
def test_a_file_without_a_mesh_is_refused_with_what_was_found(suffix, data, message, tmp_path):
    assert message in refusal_of(tmp_path, "file" + suffix, data)


def test_a_file_of_another_format_is_refused_with_what_was_expected_and_found(tmp_path):
    message = refusal_of(tmp_path, "a.msh", b"MFEM mesh v1.0\n")
    assert "line 1: expected $MeshFormat or $NOD, found 'MFEM mesh v1.0'" in message
    message = refusal_of(tmp_path, "a.mesh", b"MFEM mesh v1.0\n")
    assert "line 1: expected MeshVersionFormatted, found 'MFEM': not a Medit file" in message


@pytest.mark.parametrize("name", [*FILES, *UNCOUNTED])
@pytest.mark.parametrize("suffix", ["", ".txt", ".vtk", ".inp"])
def test_a_file_is_read_by_what_it_is_whatever_its_suffix_says(name, suffix, tmp_path):
    if name.endswith(".meshb"):
        pytest.skip("binary Medit files begin with no word")
    (tmp_path / f"mesh{suffix}").write_bytes({**FILES, **UNCOUNTED}[name])
    assert len(read_mesh(tmp_path / f"mesh{suffix}").tetrahedra) == len(BLOCK.tetrahedra)


# ------------------------------------------------------------------ broken meshes


@pytest.mark.parametrize("name", FILES)
@pytest.mark.parametrize("part", [0.1, 0.5, 0.9])
def test_a_truncated_file_is_refused(name, part, tmp_path):
    data = FILES[name]
    message = refusal_of(tmp_path, name, data[: int(part * len(data))])
    assert "expected" in message or "there are no tetrahedra; found no cells" in message


@pytest.mark.parametrize("wrong", [b"10", b"-5", b"99999999999999999999", b"1.5"])
@pytest.mark.parametrize(
    ("name", "count"),
    [
        ("gmsh 1.0.msh", b"$NOD\n%b"),
        ("gmsh 1.0.msh", b"$ELM\n%b"),
        ("gmsh 2.2 .msh", b"$Nodes\n%b"),
        ("gmsh 2.2 .msh", b"$Elements\n%b"),
        ("gmsh 2.2 <.msh", b"$Nodes\n%b"),
        ("gmsh 2.2 <.msh", b"$Elements\n%b"),
        ("gmsh 4.1 .msh", b"$Nodes\n2 %b"),
        ("gmsh 4.1 .msh", b"$Elements\n4 %b"),
        ("vtk 2.0 text.vtk", b"POINTS %b"),
        ("vtk 2.0 text.vtk", b"CELLS %b"),
        ("vtk 2.0 text.vtk", b"CELL_TYPES %b"),
        ("vtk 2.0 binary.vtk", b"POINTS %b"),
        ("vtk 2.0 binary.vtk", b"CELLS %b"),
        ("vtk 2.0 binary.vtk", b"CELL_TYPES %b"),
        ("vtk 5.1 text.vtk", b"CELLS %b"),
        ("vtk 5.1 binary.vtk", b"CELLS %b"),
        ("text.vtu", b'NumberOfPoints="%b'),
        ("text.vtu", b'NumberOfCells="%b'),
        ("binary < UInt64 plain.vtu", b'NumberOfPoints="%b'),
        ("appended < UInt64 zlib.vtu", b'NumberOfCells="%b'),
    ],
)
def test_a_wrong_count_is_refused_with_what_was_expected_and_found(name, count, wrong, tmp_path):
    n_nodes, n_cells = len(BLOCK.positions), len(BLOCK.tetrahedra) + 3
    right_texts = [count % b"%d" % n for n in (n_nodes, n_cells, n_cells + 1)]
    (right,) = (t for t in right_texts if t in FILES[name])
    message = refusal_of(tmp_path, name, FILES[name].replace(right, count % wrong))
    assert "expected" in message
    assert "found" in message


def test_a_word_among_the_numbers_is_refused_by_its_line(tmp_path):
    lines = FILES["gmsh 1.0.msh"].split(b"\n")
    lines[4] = lines[4].replace(b"0.01", b"O.01")
    message = refusal_of(tmp_path, "typo.msh", b"\n".join(lines))
    assert "line 5: expected numbers" in message
    assert "'O.01'" in message


def test_an_index_out_of_range_is_refused_by_its_tetrahedron(tmp_path):
    mesh = BLOCK._replace(tetrahedra=BLOCK.tetrahedra.copy())
    mesh.tetrahedra[3, 1] = 500
    for name, data in (
        ("1.msh", write.gmsh_1(mesh)),
        ("2.msh", write.gmsh_2(mesh, "<")),
        ("4.msh", write.gmsh_4(mesh)),
        ("a.vtk", write.vtk_legacy(mesh, "5.1", True)),
        ("a.vtu", write.vtu(mesh)),
    ):
        message = refusal_of(tmp_path, name, data)
        assert "index out of range" in message
        assert "tetrahedron 3" in message or f"names node {500 + write.FIRST_TAG}" in message


def test_a_duplicate_node_is_refused_by_its_tag(tmp_path):
    data = FILES["gmsh 1.0.msh"].replace(b"\n8 ", b"\n7 ", 1)
    assert "node 7 occurs twice" in refusal_of(tmp_path, "twice.msh", data)


def test_a_broken_mesh_is_refused_with_the_name_of_its_file(tmp_path):
    mesh = BLOCK._replace(positions=BLOCK.positions.copy())
    mesh.positions[3, 1] = np.nan
    for name, data in (("a.msh", write.gmsh_2(mesh)), ("a.vtu", write.vtu(mesh))):
        assert "node 3 has a coordinate that is NaN" in refusal_of(tmp_path, name, data)


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        ([("triangle", [[0, 1, 2]])], "only a surface, no tetrahedra: found 1 triangles"),
        ([("line", [[0, 1]])], "no tetrahedra; found 1 lines"),
        ([("quad", [[0, 1, 2, 3]])], "only a surface, no tetrahedra: found 1 quadrangles"),
    ],
)
@pytest.mark.parametrize("name", ["a.msh", "a.vtk", "a.vtu"])
def test_cells_without_a_volume_are_refused(name, cells, message, tmp_path):
    path = tmp_path / name
    mesh = meshio.Mesh(BLOCK.positions, [(k, np.array([list(c) for c in cs])) for k, cs in cells])
    meshio.write(path, mesh, file_format="gmsh22" if name == "a.msh" else None)
    assert message in refusal(path)


def test_xml_that_defines_entities_is_refused(tmp_path):
    bomb = b'<!DOCTYPE a [<!ENTITY b "bb">]>' + FILES["text.vtu"]
    assert "document type" in refusal_of(tmp_path, "bomb.vtu", bomb)


def test_a_block_that_unpacks_to_more_than_declared_is_refused(tmp_path):
    original = write.vtu(BLOCK, "appended", is_compressed=True)
    data = original.replace(b'NumberOfPoints="18"', b'NumberOfPoints="17"')
    assert "expected 408 bytes of numbers, found 432" in refusal_of(tmp_path, "z.vtu", data)


# ------------------------------------------------------------------ written files


def snapshot():
    rng = np.random.default_rng(0)
    n = len(BLOCK.positions)
    moved = BLOCK.positions + rng.uniform(-1e-4, 1e-4, (n, 3))
    velocities, masses = rng.normal(size=(n, 3)), rng.uniform(1e-6, 1e-3, n)
    fixed = side_nodes(BLOCK, ["left"])
    return Snapshot(
        *(moved, BLOCK.positions, velocities, masses, 0.1 * masses, BLOCK.tetrahedra, fixed),
        np.zeros(len(BLOCK.tetrahedra), np.int64),
    )


def test_a_snapshot_is_read_by_meshio_to_the_last_bit(tmp_path):
    write_vtu(tmp_path / "body.vtu", snapshot())
    mesh = meshio.read(tmp_path / "body.vtu")
    assert mesh.points.dtype == np.float64
    assert np.array_equal(mesh.points, snapshot().positions)
    assert np.array_equal(mesh.cells_dict["tetra"], BLOCK.tetrahedra)
    assert np.array_equal(mesh.point_data["rest_position"], BLOCK.positions)
    assert np.array_equal(mesh.point_data["velocity"], snapshot().velocities)
    assert np.array_equal(mesh.point_data["mass"], snapshot().masses)
    assert np.array_equal(mesh.point_data["fixed"].astype(bool), snapshot().fixed)


def test_the_cell_data_has_the_piece_of_each_tetrahedron(tmp_path):
    alone = TetrahedralMesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]]))
    n = len(BLOCK.positions)
    body = Snapshot(
        np.vstack([alone.positions - 5.0, BLOCK.positions]),
        np.vstack([alone.positions * 0.001, BLOCK.positions]),
        np.zeros((n + 4, 3)),
        np.ones(n + 4),
        np.zeros(n + 4),
        np.vstack([alone.tetrahedra, BLOCK.tetrahedra + 4]),
        np.zeros(n + 4, dtype=bool),
        np.zeros(1 + len(BLOCK.tetrahedra), np.int64),
    )
    write_vtu(tmp_path / "body.vtu", body)
    (piece,) = meshio.read(tmp_path / "body.vtu").cell_data["piece"]
    assert piece.tolist() == [1] + [0] * len(BLOCK.tetrahedra)  # the largest at rest is 0


def test_meshio_reads_the_stress_and_strain_of_each_tetrahedron(tmp_path):
    at = BLOCK.positions * [1.2, 0.9, 1.0]
    every = np.ones(len(at), dtype=bool)
    tissue = Tissue(BLOCK, fixed=every, positions=at)
    found = tissue.deformation()
    write_vtu(tmp_path / "body.vtu", tissue.snapshot(), found)
    cells = {name: data[0] for name, data in meshio.read(tmp_path / "body.vtu").cell_data.items()}
    assert np.array_equal(cells["stress"].reshape(-1, 3, 3), found.stress.astype(np.float32))
    assert cells["strain"].reshape(-1, 3, 3)[:, 0, 0] == pytest.approx(0.22, rel=1e-6)
    assert np.array_equal(cells["von_mises"], found.von_mises().astype(np.float32))


def test_stress_of_another_body_is_refused(tmp_path):
    other = Tissue(block((1, 1, 1), (0.01, 0.01, 0.01))).deformation()
    with pytest.raises(ValueError, match="the stress is that of 6 tetrahedra, and the body has"):
        write_vtu(tmp_path / "body.vtu", snapshot(), other)


def test_a_written_snapshot_is_read_as_a_mesh(tmp_path):
    write_vtu(tmp_path / "body.vtu", snapshot())
    mesh = read_mesh(tmp_path / "body.vtu")
    assert np.array_equal(mesh.positions, snapshot().positions)
    assert np.array_equal(mesh.tetrahedra, BLOCK.tetrahedra)


class Interrupts:
    """An array that acts as if the user pressed Ctrl-C while it is written."""

    def __array__(self, *_, **__):
        raise KeyboardInterrupt


def test_an_interrupted_write_leaves_the_old_file_and_nothing_else(tmp_path):
    path = tmp_path / "body.vtu"
    write_vtu(path, snapshot())
    before = path.read_bytes()
    with pytest.raises(KeyboardInterrupt):
        write_vtu(path, snapshot()._replace(fixed=Interrupts()))
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["body.vtu"]


# ------------------------------------------------------------------ third-party meshes


@pytest.mark.skipif(not bodies.FOLDER, reason="SCALPEL_SIM_TEST_MESHES names no folder")
@pytest.mark.parametrize(
    ("file", "n_nodes", "n_tetrahedra"),
    [
        ("sofa_liver.msh", 181, 596),
        ("sofa_truthcylinder1.msh", 642, 2524),
        ("bullet_banana.vtk", 725, 2395),
        ("sofaenv_tissue_volume.msh", 493, 1432),
    ],
)
def test_public_meshes_are_read_and_can_be_held_by_their_sides(file, n_nodes, n_tetrahedra):
    mesh = read_mesh(os.path.join(str(bodies.FOLDER), file), bodies.FILES[file])
    assert (len(mesh.positions), len(mesh.tetrahedra)) == (n_nodes, n_tetrahedra)
    for side in ("left", "right"):
        assert 3 <= side_nodes(mesh, [side]).sum() < n_nodes / 4


def shuffled(mesh):
    """Return a mesh with its nodes and tetrahedra in random order."""
    random = np.random.default_rng(0)
    order = random.permutation(len(mesh.positions))
    place = np.argsort(order)
    tetrahedra = random.permutation(place[mesh.tetrahedra])
    return TetrahedralMesh(mesh.positions[order], tetrahedra)


def spread(mesh):
    """Return the mean range of the node numbers of a tetrahedron."""
    return np.ptp(mesh.tetrahedra, axis=1).mean()


def test_renumbering_does_not_change_the_geometry():
    mesh = shuffled(bodies.jittered(4, 0))
    other, place = renumbered(mesh)
    np.testing.assert_array_equal(other.positions[place], mesh.positions)

    def corners(m):
        return sorted(map(tuple, m.positions[m.tetrahedra].reshape(-1, 12).tolist()))

    assert corners(other) == corners(mesh)


def test_labels_follow_their_tetrahedra_as_these_are_renumbered():
    mesh = shuffled(bodies.jittered(4, 0))
    by_place = mesh._replace(labels=np.arange(len(mesh.tetrahedra)), label_names={3: "vessel"})
    other, place = renumbered(by_place)
    np.testing.assert_array_equal(place[mesh.tetrahedra[other.labels]], other.tetrahedra)
    assert other.label_names == {3: "vessel"}


def test_numbers_of_neighbours_are_about_as_close_as_in_a_grid():
    mesh = bodies.jittered(6, 0)
    assert spread(renumbered(shuffled(mesh))[0]) < 1.3 * spread(mesh) < 0.4 * spread(shuffled(mesh))


def test_a_large_body_is_renumbered_as_it_is_read(tmp_path, monkeypatch):
    mesh = shuffled(bodies.jittered(4, 0))
    (tmp_path / "body.vtu").write_bytes(mesh_writers.vtu(mesh))
    np.testing.assert_array_equal(read_mesh(tmp_path / "body.vtu").tetrahedra, mesh.tetrahedra)
    monkeypatch.setattr(mesh_io, "RENUMBER_FROM", len(mesh.tetrahedra))
    read = read_mesh(tmp_path / "body.vtu")
    np.testing.assert_array_equal(read.tetrahedra, renumbered(mesh)[0].tetrahedra)


def test_tetrahedra_are_sorted_by_their_nodes():
    lowest = renumbered(shuffled(bodies.jittered(4, 0)))[0].tetrahedra.min(axis=1)
    assert (np.diff(lowest) >= 0).all()


def test_a_mesh_is_written_as_it_is_read(tmp_path):
    mesh = bodies.jittered(3, 0)._replace(labels=np.arange(174) % 4)
    write_mesh(tmp_path / "mesh.vtu", mesh)
    again = read_mesh(tmp_path / "mesh.vtu")
    np.testing.assert_array_equal(again.positions, mesh.positions)
    np.testing.assert_array_equal(again.tetrahedra, mesh.tetrahedra)
    (labels,) = meshio.read(tmp_path / "mesh.vtu").cell_data["label"]
    np.testing.assert_array_equal(labels, mesh.labels)
