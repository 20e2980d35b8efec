"""Meshes come as arrays of any type of numbers, and are taken or refused in one sentence."""

import copy
import logging
import pickle

import meshio
import numpy as np
import pytest

from tissue import (
    Material,
    MeshError,
    TetrahedralMesh,
    Tissue,
    block,
    boundary_faces,
    calibrated,
    fixed_nodes,
    mesh_from_arrays,
    pieces_of,
    read_mesh,
    write_vtu,
)

SPRINGS = Material(law="springs", poisson_ratio=0.25)


def a_mesh():
    return block((2, 2, 2), (0.04, 0.04, 0.04))


def snapshot_of(mesh):
    whole = Tissue(a_mesh()).snapshot()
    return whole._replace(
        positions=mesh.positions, rest_positions=mesh.positions, tetrahedra=mesh.tetrahedra
    )


def written(mesh, folder):
    write_vtu(folder / "body.vtu", snapshot_of(mesh))
    return read_mesh(folder / "body.vtu").tetrahedra.tolist()


def stepped(mesh):
    tissue = Tissue(mesh, fixed=np.arange(27) < 9)
    tissue.step(None, 1e-3)
    return tissue.snapshot().positions.tolist()


CONSUMERS = {
    "tissue": lambda mesh, _: stepped(mesh),
    "side": lambda mesh, _: fixed_nodes(mesh, "left").tolist(),
    "underside": lambda mesh, _: fixed_nodes(mesh, "underside").tolist(),
    "box": lambda mesh, _: fixed_nodes(mesh, "-1,-1,-1:1,1,0.01").tolist(),
    "sphere": lambda mesh, _: fixed_nodes(mesh, "sphere:0,0,0,0.02").tolist(),
    "springs": lambda mesh, _: calibrated(mesh, SPRINGS),
    "faces": lambda mesh, _: boundary_faces(mesh.tetrahedra).tolist(),
    "pieces": lambda mesh, _: len(pieces_of(snapshot_of(mesh))),
    "writer": written,
}


@pytest.mark.parametrize("name", CONSUMERS)
@pytest.mark.parametrize("kind", ["u1", "u4", "u8", "i4", ">i8", ">u4", "reversed", "list"])
def test_tetrahedra_of_any_whole_numbers_give_the_same(name, kind, tmp_path):
    mesh = a_mesh()
    if kind == "reversed":  # strides are negative
        other = mesh.tetrahedra[::-1].copy()[::-1]
    else:
        other = mesh.tetrahedra.tolist() if kind == "list" else mesh.tetrahedra.astype(kind)
    used = CONSUMERS[name]
    assert used(TetrahedralMesh(mesh.positions, other), tmp_path) == used(mesh, tmp_path)


@pytest.mark.parametrize("kind", [">f8", "g", "list", "columns"])
def test_positions_of_any_real_numbers_give_the_same_motion(kind):
    mesh = a_mesh()
    others = {"list": mesh.positions.tolist(), "columns": np.asfortranarray(mesh.positions)}
    other = others[kind] if kind in others else mesh.positions.astype(kind)
    assert stepped(TetrahedralMesh(other, mesh.tetrahedra)) == stepped(mesh)


@pytest.mark.parametrize("name", CONSUMERS)
@pytest.mark.parametrize("kind", ["f8", "?", "O"])
def test_tetrahedra_that_are_no_whole_numbers_are_refused_in_one_sentence(name, kind, tmp_path):
    mesh = a_mesh()
    wrong = TetrahedralMesh(mesh.positions, mesh.tetrahedra.astype(kind))
    with pytest.raises(MeshError, match="must be whole numbers of shape"):
        CONSUMERS[name](wrong, tmp_path)


def test_arrays_in_millimetres_that_wind_either_way_make_a_body(caplog):
    mesh = a_mesh()
    wound = np.where(np.arange(48)[:, None] % 2, mesh.tetrahedra[:, [1, 0, 2, 3]], mesh.tetrahedra)
    in_millimetres = np.concatenate([1e3 * mesh.positions, [[0.0, 0.0, 0.0]]]).astype("f4")
    labels = np.arange(48, dtype="u1") // 24
    with pytest.raises(MeshError, match=r"make it by tissue\.mesh_from_arrays"):
        Tissue(TetrahedralMesh(mesh.positions, wound))
    with caplog.at_level(logging.WARNING, logger="tissue"):
        made = mesh_from_arrays(in_millimetres, wound, labels, label_names={1: "fat"}, scale=1e-3)
    assert [each.split(":")[1][:10] for each in caplog.messages] == [" dropped 1", " inverted "]
    np.testing.assert_allclose(made.positions, mesh.positions, rtol=1e-6)
    np.testing.assert_array_equal(made.labels, labels)
    assert made.label_names == {1: "fat"}
    assert Tissue(made).snapshot().tetrahedra.shape == (48, 4)


@pytest.mark.parametrize("scale", [0.0, -1.0, np.nan])
def test_arrays_with_a_scale_that_is_not_positive_are_refused(scale):
    with pytest.raises(ValueError, match="scale is"):
        mesh_from_arrays(*a_mesh()[:2], scale=scale)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda mesh: pickle.loads(pickle.dumps(mesh))])
def test_a_mesh_with_labels_is_copied_and_pickled(copied):
    mesh = mesh_from_arrays(*a_mesh()[:2], np.arange(48), label_names={2: "vessel"})
    other = copied(mesh)
    assert other.label_names == {2: "vessel"}
    for mine, theirs in zip(mesh[:3], other[:3], strict=True):
        np.testing.assert_array_equal(mine, theirs)


def test_labels_are_written_as_cell_data_that_meshio_reads(tmp_path):
    labels = np.arange(48) % 5
    write_vtu(tmp_path / "body.vtu", snapshot_of(a_mesh()), labels=labels)
    (read,) = meshio.read(tmp_path / "body.vtu").cell_data["label"]
    np.testing.assert_array_equal(read, labels)
    with pytest.raises(MeshError, match="one for each of the 48"):
        write_vtu(tmp_path / "body.vtu", snapshot_of(a_mesh()), labels=labels[1:])
