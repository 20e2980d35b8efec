"""Exported surfaces, read again by trimesh: closed, of the right volume, outward, by piece."""

from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
import trimesh

from scalpel_sim import SavedRun
from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import UsageError
from scalpel_sim.output.export import ENDINGS, export_surface
from scalpel_sim.output.surface_pieces import surface_pieces
from scalpel_sim.scene.label_colours import LabelColours, TissueColours
from scalpel_sim.viewer.looks import LOOKS
from scalpel_sim.viewer.textures import even_colours
from tests.support import strokes
from tests.support.usd import usd_scene
from tissue import Material, Surface, TetrahedralMesh, Tissue, block, liver_lobe
from tissue.mesh.pieces import piece_of_tetrahedra

BLOCK = block((4, 2, 2), (0.04, 0.02, 0.02))

FULL, SINGLE = 1e-9, 1e-5
"""Relative error of volumes in formats with full and with single precision."""

PRECISION = {ending: FULL if ending == ".obj" else SINGLE for ending in ENDINGS}


class Body(NamedTuple):
    surface: Surface
    volumes: np.ndarray
    """Sum of the volumes of the tetrahedra of each piece [m3]."""
    ends_inside: bool
    """Whether a cut ends in it."""


def cut_block() -> Tissue:
    """Return a block that is held at one end and cut across; the free end hangs and moves."""
    tissue = Tissue(
        BLOCK,
        Material(toughness=0.5, friction=0.0),
        fixed=BLOCK.positions[:, 0] <= 0.02,
        gravity=(9.81, 0.0, 0.0),
    )
    strokes.make(tissue, strokes.straight(BLOCK, 0.75))
    for _ in range(20):
        tissue.step(None, 1e-3)
    return tissue


def half_cut_block() -> Tissue:
    """Return a block with a cut that ends in the middle."""
    tissue = Tissue(BLOCK, fixed=BLOCK.positions[:, 0] <= 0.005)
    places = np.linspace(-0.005, 0.0113, 20)
    edges = [([0.021, y, -0.005], [0.023, y, 0.025]) for y in places]
    tissue.incise([(np.array(tip), np.array(heel)) for tip, heel in edges], [0.0, 1.0, 0.0])
    return tissue


TISSUES = {
    "block": lambda: Tissue(BLOCK),
    "liver lobe": lambda: Tissue(liver_lobe()),
    "half cut block": half_cut_block,
    "two pieces": cut_block,
}


@pytest.fixture(scope="module", params=TISSUES.values(), ids=TISSUES)
def body(request) -> Body:
    tissue = request.param()
    snapshot = tissue.snapshot()
    corners = snapshot.positions[snapshot.tetrahedra]
    volumes = np.linalg.det(corners[:, 1:] - corners[:, :1]) / 6.0
    of_pieces = np.bincount(piece_of_tetrahedra(snapshot), volumes)
    return Body(tissue.surface(), of_pieces, request.param is half_cut_block)


def exported(body: Body, folder: Path, ending: str) -> trimesh.Trimesh:
    """Write a body and read it again, as one mesh whose parts share their vertices."""
    path = folder / f"body{ending}"
    export_surface(body.surface, path)
    return exported_mesh(path)


def exported_mesh(path: Path) -> trimesh.Trimesh:
    """Read the tissue of a file as one mesh whose parts share their vertices."""
    read = usd_scene(path) if path.suffix.startswith(".usd") else trimesh.load(path)
    if isinstance(read, trimesh.Scene):
        read.delete_geometry([name for name in read.geometry if not name.startswith("piece_")])
        read = read.to_geometry()
        read.merge_vertices(merge_tex=True, merge_norm=True)
    return read


def assert_is_closed(mesh: trimesh.Trimesh) -> None:
    """Assert that each edge is passed as often in one direction as in the other."""
    n = len(mesh.vertices)
    there, back = mesh.edges @ [n, 1], mesh.edges @ [1, n]
    assert np.array_equal(np.sort(there), np.sort(back))


def test_as_a_trimesh_mesh_each_piece_is_closed_and_has_the_volume_of_its_tetrahedra(body):
    pieces = surface_pieces(body.surface)
    assert len(pieces) == len(body.volumes)
    for piece, volume in zip(pieces, body.volumes, strict=True):
        mesh = piece.surface.to_trimesh()
        assert_is_closed(mesh)
        assert mesh.volume == pytest.approx(volume, rel=FULL)


@pytest.mark.parametrize("ending", ENDINGS)
def test_an_exported_body_is_closed_and_each_piece_has_the_volume_of_its_tetrahedra(
    body, ending, tmp_path
):
    """A cut that ends in the body has edges that four triangles share: no watertight pieces."""
    mesh = exported(body, tmp_path, ending)
    assert_is_closed(mesh)
    volumes = [mesh.volume]
    if mesh.is_watertight:
        assert mesh.is_winding_consistent
        volumes = sorted((each.volume for each in mesh.split()), reverse=True)
    assert mesh.is_watertight or body.ends_inside
    expected = body.volumes if mesh.is_watertight else [body.volumes.sum()]
    assert volumes == pytest.approx(list(expected), rel=PRECISION[ending])


def test_the_normals_of_a_block_point_out_of_it():
    mesh = Tissue(BLOCK).surface().to_trimesh()
    normals, middles = mesh.face_normals, mesh.triangles_center
    size = np.array([0.04, 0.02, 0.02])
    side = np.rint(np.where(np.abs(middles / size - 0.5) > 0.499, 2.0 * middles / size - 1.0, 0.0))
    np.testing.assert_allclose(normals, side, atol=1e-12)


def test_faces_of_a_cut_are_marked_and_have_a_colour_of_their_own():
    surface = half_cut_block().surface()
    mesh = surface.to_trimesh()
    assert 0 < surface.is_cut.sum() < len(surface.is_cut)
    assert np.array_equal(mesh.face_attributes["is_cut"], surface.is_cut)
    skin, cut = (
        np.unique(mesh.visual.face_colors[chosen], axis=0)
        for chosen in (~surface.is_cut, surface.is_cut)
    )
    assert len(skin) == len(cut) == 1 and not np.array_equal(skin, cut)


def hollow_block() -> Tissue:
    """Return a block of 3 x 3 x 3 cells, with a smaller, loose block in place of the middle one."""
    mesh, inner = block((3, 3, 3), (0.03, 0.03, 0.03)), block((1, 1, 1), (0.004, 0.004, 0.004))
    middles = mesh.positions[mesh.tetrahedra].mean(axis=1)
    around = (np.abs(middles - 0.015) > 0.005).any(axis=1)
    positions = np.vstack([mesh.positions, inner.positions + 0.013])
    loose = inner.tetrahedra + len(mesh.positions)
    return Tissue(TetrahedralMesh(positions, np.vstack([mesh.tetrahedra[around], loose])))


def test_a_cavity_belongs_to_the_piece_around_it():
    pieces = surface_pieces(hollow_block().surface())
    assert [piece.name for piece in pieces] == ["piece_1", "piece_2"]
    volumes = [piece.surface.to_trimesh().volume for piece in pieces]
    assert volumes == pytest.approx([0.03**3 - 0.01**3, 0.004**3])


def test_a_glb_has_a_node_for_each_piece_and_meshes_for_its_skin_and_its_cut_faces(tmp_path):
    surface = cut_block().surface()
    export_surface(surface, tmp_path / "body.glb")
    scene = trimesh.load(tmp_path / "body.glb")
    parts = {f"piece_{i}_{part}" for i in (1, 2) for part in ("skin", "cut")}
    assert scene.geometry.keys() == parts
    assert scene.graph.transforms.parents["piece_2_cut"] == "piece_2"
    n_cut = sum(len(mesh.faces) for name, mesh in scene.geometry.items() if "cut" in name)
    assert n_cut == surface.is_cut.sum()
    colours = {
        name: tuple(mesh.visual.material.baseColorFactor) for name, mesh in scene.geometry.items()
    }
    assert colours["piece_1_cut"] == colours["piece_2_cut"] != colours["piece_1_skin"]


def test_in_a_glb_y_points_up(tmp_path):
    surface = cut_block().surface()
    export_surface(surface, tmp_path / "body.glb")
    vertices = trimesh.load(tmp_path / "body.glb").to_geometry().bounds
    low, high = surface.positions.min(axis=0), surface.positions.max(axis=0)
    expected = [[low[0], low[2], -high[1]], [high[0], high[2], -low[1]]]
    np.testing.assert_allclose(vertices, expected, atol=1e-6)


def test_an_obj_has_an_object_for_each_piece_with_groups_for_skin_and_cut_faces(tmp_path):
    export_surface(cut_block().surface(), tmp_path / "body.obj")
    lines = (tmp_path / "body.obj").read_text().splitlines()
    names = [line for line in lines if line[0] in "og"]
    assert names == [
        f"{kind} piece_{i}{part}"
        for i in (1, 2)
        for kind, part in (("o", ""), ("g", "_skin"), ("g", "_cut"))
    ]


def test_a_ply_marks_each_face_with_its_piece_and_whether_it_is_of_a_cut(tmp_path):
    surface = cut_block().surface()
    export_surface(surface, tmp_path / "body.ply")
    faces = trimesh.load(tmp_path / "body.ply").metadata["_ply_raw"]["face"]["data"]
    assert np.array_equal(faces["is_cut"].ravel(), surface.is_cut)
    assert np.unique(faces["piece"]).tolist() == [1, 2]


def test_another_ending_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(UsageError, match=r"must end in \.stl, \.obj, \.ply, \.glb, \.usd"):
        export_surface(Tissue(BLOCK).surface(), tmp_path / "body.dae")


def run(*words: str) -> int:
    return command_line(["run", "grid2", "--quiet", "--seconds", "0.01", *words])


def test_a_run_exports_the_body_to_each_file_that_is_asked_for(tmp_path):
    files = [tmp_path / f"body{ending}" for ending in (*ENDINGS, ".STL")]
    options = [word for file in files for word in ("--export", str(file))]
    assert run("--out", str(tmp_path / "out"), *options) == 0
    assert all(exported_mesh(file).area > 0.0 for file in files)


def test_the_report_of_a_run_names_what_was_exported_and_recorded(tmp_path, capsys):
    file, record = tmp_path / "body.stl", tmp_path / "run.vtkhdf"
    words = ["run", "grid2", "--seconds", "0.01", "--out", str(tmp_path / "out")]
    assert command_line([*words, "--export", str(file), "--record", str(record)]) == 0
    said = capsys.readouterr().out
    assert f"exported: {file}" in said
    assert f"recorded: {record}; scalpel-sim replay {record} plays it" in said
    with SavedRun(record) as run:
        assert run.times.tolist() == [0.0, 0.01] and len(run.rows) == 10


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("body.txt", "must end in .stl, .obj, .ply, .glb, .usd, .usda or .usdc"),
        ("body", "must end in .stl, .obj, .ply, .glb, .usd, .usda or .usdc"),
        ("nowhere/body.stl", "there is no folder"),
    ],
)
def test_a_file_that_cannot_be_exported_to_is_refused_before_the_run(
    name, expected, tmp_path, capsys
):
    assert run("--out", str(tmp_path / "out"), "--export", str(tmp_path / name)) == 2
    assert expected in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


LABELS = (
    LabelColours(0, "the rest", "a23a34", "b03a34"),
    LabelColours(3, "fat", "e6c46c", "f0c000"),
)


def labelled_surface() -> Surface:
    """Return the surface of a block of two labels, with a cut through both of them."""
    middles = BLOCK.positions[BLOCK.tetrahedra].mean(axis=1)
    mesh = BLOCK._replace(labels=np.where(middles[:, 1] < 0.01, 0, 3))
    tissue = Tissue(mesh, Material(toughness=0.5), fixed=BLOCK.positions[:, 0] <= 0.005)
    strokes.make(tissue, strokes.straight(BLOCK, 0.75))
    return tissue.surface()


def test_faces_of_a_ply_have_the_label_and_its_colour(tmp_path):
    surface = labelled_surface()
    export_surface(surface, tmp_path / "two.ply", TissueColours(labels=LABELS))
    read = trimesh.load(tmp_path / "two.ply")
    data = read.metadata["_ply_raw"]["face"]["data"]
    assert np.array_equal(data["label"].ravel(), surface.labels)
    for label, is_cut, colour in (
        (0, False, [0xA2, 0x3A, 0x34]),
        (3, False, [0xE6, 0xC4, 0x6C]),
        (3, True, [0xF0, 0xC0, 0x00]),
    ):
        chosen = (surface.labels == label) & (surface.is_cut == is_cut)
        assert chosen.any() and (read.visual.face_colors[chosen][:, :3] == colour).all()


@pytest.mark.parametrize("ending", [".obj", ".glb", ".usda", ".usdc"])
def test_groups_of_an_obj_and_meshes_of_a_glb_or_usd_are_one_for_each_label(ending, tmp_path):
    surface, path = labelled_surface(), tmp_path / f"two{ending}"
    export_surface(surface, path, TissueColours(labels=LABELS))
    names = [
        f"piece_{piece}_{part}_{label}"
        for piece in (1, 2)
        for part in ("skin", "cut")
        for label in ("0_the_rest", "3_fat")
    ]
    if ending == ".obj":
        found = [line[2:] for line in path.read_text().splitlines() if line.startswith("g ")]
        assert found == names
    else:
        scene = trimesh.load(path) if ending == ".glb" else usd_scene(path)
        assert sorted(scene.geometry) == sorted(names)
        part = scene.geometry["piece_1_cut_3_fat"]
        fat = part.metadata.get("colour")
        if ending == ".glb":
            fat = part.visual.material.baseColorFactor[:3] / 255.0
        np.testing.assert_allclose(fat, [0.875, 0.536, 0.0], atol=0.01)
    assert_is_closed(exported_mesh(path))


@pytest.mark.parametrize("ending", [".glb", ".usda"])
def test_tissue_has_the_colour_that_its_material_has_on_pages(ending, tmp_path):
    path = tmp_path / f"fat{ending}"
    export_surface(Tissue(BLOCK).surface(), path, even_colours(LOOKS["fat"]))
    scene = trimesh.load(path) if ending == ".glb" else usd_scene(path)
    skin = scene.geometry["piece_1_skin"]
    found = skin.metadata.get("colour")
    if ending == ".glb":
        found = skin.visual.material.baseColorFactor[:3] / 255.0
    np.testing.assert_allclose(found, (np.array([0xDE, 0xB8, 0x5C]) / 255.0) ** 2.2, atol=0.01)
