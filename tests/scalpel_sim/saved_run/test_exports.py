"""Files of a recorded run for other programs: surfaces, tetrahedra, arms, and all instants."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest
import trimesh

from scalpel_sim import SCENES, RunRecorder, SavedRun, prepare
from scalpel_sim.cli.app import command_line
from scalpel_sim.output.export import ENDINGS
from scalpel_sim.scene.scene import changed
from scalpel_sim.viewer.model_shapes import in_world
from tests.scalpel_sim.output.test_export import exported_mesh
from tests.support.usd import usd_scene
from tissue import read_mesh

LAYERS = changed(SCENES["layers"], seconds=0.2)
"""A body of several labels."""

Y_UP = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""From z up to y up."""

ROUNDING = 1e-6
"""Difference of places in single precision, in a scene of 1 m [m]."""


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    path, simulation = tmp_path_factory.mktemp("recorded") / "run.vtkhdf", prepare(LAYERS)
    with RunRecorder(simulation, path, seconds=0.2):
        simulation.run(0.2)
    return path


@pytest.mark.parametrize("ending", ENDINGS)
def test_an_instant_is_written_in_each_format_of_surfaces(ending, recorded, tmp_path, capsys):
    path = tmp_path / f"body{ending}"
    assert command_line(["export", str(recorded), "--at", "0.1", "-o", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}: the body at 0.08 s, step 3 of 6\n"
    with SavedRun(recorded) as run:
        expected = run.at(0.1).surface.to_trimesh()
    assert exported_mesh(path).volume == pytest.approx(expected.volume, rel=1e-5)


@pytest.mark.parametrize(("ending", "axes"), [(".glb", Y_UP), (".usd", np.eye(3))])
def test_the_arm_is_where_it_was_beside_the_body(ending, axes, recorded, tmp_path):
    path = tmp_path / f"all{ending}"
    assert command_line(["export", str(recorded), "--at", "0.1", "-o", str(path)]) == 0
    scene = trimesh.load(path) if ending == ".glb" else usd_scene(path)
    with SavedRun(recorded) as run:
        step, shapes, bodies, frame = run.at(0.1), run.stage.shapes, run.bodies, run.frame
    seen = [shape for shape in shapes if not shape.is_target]
    assert len(seen) > 10 and any(shape.body == 0 for shape in seen)
    for shape in seen:
        transform, name = scene.graph[f"{bodies[shape.body]}_{shape.name}"]
        mesh = scene.geometry[name]
        places = in_world(shape, step.body_poses, shape.mesh.positions)
        expected = trimesh.PointCloud(frame.points_to_tissue(places) @ axes.T)
        there = trimesh.transform_points(mesh.vertices, transform)
        np.testing.assert_allclose(
            [there.min(axis=0), there.max(axis=0)], expected.bounds, atol=ROUNDING
        )
        colour, roughness = paint_of(mesh)
        np.testing.assert_allclose(colour[:3], shape.colour[:3] ** 2.2, atol=0.01)
        assert roughness == (0.25 if shape.is_end else 0.5)
        if shape.is_blade:
            edge = frame.points_to_tissue(np.array([step.blade.tip, step.blade.heel])) @ axes.T
            ways = np.linalg.norm(there[:, None] - edge, axis=2).min(axis=0)
            assert ways.max() < ROUNDING


def paint_of(mesh):
    """Return the colour, linear light from 0 to 1, and the roughness."""
    if "colour" in mesh.metadata:
        return mesh.metadata["colour"], mesh.metadata["roughness"]
    material = mesh.visual.material
    return material.baseColorFactor / 255.0, material.roughnessFactor


def test_an_instant_is_written_as_tetrahedra_with_labels_and_their_names(recorded, tmp_path):
    path = tmp_path / "body.vtu"
    assert command_line(["export", str(recorded), "-o", str(path)]) == 0
    mesh = read_mesh(path)
    with SavedRun(recorded) as run:
        step = run.step(-1)
        assert step.time == 0.2 and set(mesh.label_names.values()) == set(run.label_names.values())
    assert np.array_equal(mesh.positions, step.snapshot.positions)
    assert np.array_equal(mesh.labels, step.snapshot.labels) and len(set(mesh.labels)) > 1
    meshio = pytest.importorskip("meshio")
    stress = meshio.read(path).cell_data["stress"][0]
    assert np.array_equal(stress, step.deformation.stress.reshape(-1, 9).astype("f4"))


def test_a_collection_names_a_file_of_each_instant(recorded, tmp_path, capsys):
    path = tmp_path / "a & b.pvd"
    assert command_line(["export", str(recorded), "-o", str(path)]) == 0
    assert capsys.readouterr().out == f"{path}: the body at 6 instants, to 0.2 s\n"
    listed = list(ET.parse(path).getroot().iter("DataSet"))
    with SavedRun(recorded) as run:
        assert [float(each.get("timestep")) for each in listed] == run.times.tolist()
        for number, each in enumerate(listed):
            mesh = read_mesh(tmp_path / each.get("file"))
            assert np.array_equal(mesh.positions, run.step(number).snapshot.positions)
    assert len(list((tmp_path / "a & b_steps").iterdir())) == 6


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--at", "0.21", "-o", "x.stl"], "has no instant 0.21 s; it goes from 0 to 0.2 s"),
        (["-o", "x.dae"], "must end in .vtu, .pvd, .stl, .obj, .ply, .glb, .usd, .usda or .usdc"),
        (["-o", "nowhere/x.stl"], "there is no folder nowhere"),
        (["--at", "0.1", "-o", "x.pvd"], "a .pvd file has all instants: leave out --at"),
        (["-o", "taken.pvd"], "taken_steps: is a file, where a folder is needed"),
    ],
)
def test_an_export_that_is_not_possible_is_refused(
    words, said, recorded, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "taken_steps").touch()
    assert command_line(["export", str(recorded), *words]) == 2
    assert said in capsys.readouterr().err
    assert [each.name for each in tmp_path.iterdir()] == ["taken_steps"]
