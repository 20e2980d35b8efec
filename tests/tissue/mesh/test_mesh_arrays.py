"""Meshes come as arrays of any type of numbers, and are taken or refused in one sentence."""

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
