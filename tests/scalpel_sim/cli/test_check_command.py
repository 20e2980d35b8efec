"""`scalpel-sim check` says what is in the file of a mesh, and how fast it will be cut."""

import json
import re

import meshio
import numpy as np
import pytest
from rich.console import Console

from scalpel_sim.cli.app import command_line
from scalpel_sim.cli.check_command import Speed, print_mesh
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE
from scalpel_sim.runs.warm_up import KernelSet, compile_ahead
from scalpel_sim.scene.read import DEFAULT_SCENE, SCENES
from scalpel_sim.validate.speed.expected import (
    MILLISECOND,
    as_run,
    cost_of_body,
    expected_factors,
    factor_of_body,
    scene_costs,
)
from tests.tissue.io import mesh_writers as write
from tissue import MATERIALS, SolverSettings, Tissue, block, report_on_mesh

MESH = block((4, 4, 2), (40.0, 40.0, 20.0))
"""A block in millimetres."""

LABELLED = MESH._replace(
    labels=1 + (MESH.positions[MESH.tetrahedra].mean(axis=1)[:, 2] > 10.0),
    label_names={2: "skin"},
)


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "block.msh"
    path.write_bytes(write.gmsh_2(LABELLED))
    return path


def checked(capsys, *words):
    """Return what the command prints as JSON, its exit code, and what it says of errors."""
    code = command_line(["check", "--json", *map(str, words)])
    printed = capsys.readouterr()
    return json.loads(printed.out), code, printed.err


def test_it_finds_cells_unit_size_quality_and_labels(file, capsys):
    found, code, _ = checked(capsys, file)
    assert code == EXIT_OK
    assert found["format"] == "Gmsh 2, text"
    assert found["cells"] == {"lines": 1, "triangles": 1, "tetrahedra": 192, "points": 1}
    assert (found["scale"], found["scale_is_guessed"]) == (0.001, True)
    np.testing.assert_allclose(found["box"], [[0.0, 0.0, 0.0], [0.04, 0.04, 0.02]])
    shape = found["shape"]
    assert shape["volume"] == pytest.approx(32e-6)
    assert [each["name"] for each in shape["labels"]] == [None, "skin"]
    assert [each["volume"] for each in shape["labels"]] == pytest.approx([16e-6, 16e-6])
    assert sum(each["n_tetrahedra"] for each in shape["labels"]) == 192
    assert shape["n_pieces"] == 1
    assert shape["altitude"] == pytest.approx(0.01 / np.sqrt(2.0))
    assert 0.0 < shape["quality_min"] <= shape["quality_median"] <= 1.0


def test_the_time_step_is_that_of_the_body_in_the_material_that_is_asked(file, capsys):
    steps = {}
    for name, words in {"gel": (), "liver": ("--material", "liver")}.items():
        found, _, _ = checked(capsys, file, *words)
        steps[name] = found["speed"]["time_step"]
    assert steps["gel"] != steps["liver"]
    mesh = MESH._replace(positions=1e-3 * MESH.positions)
    solver = SolverSettings(precision="single")
    expected = Tissue(mesh, MATERIALS["liver"].material, solver=solver).cut_report().initial
    assert steps["liver"] == pytest.approx(expected.time_step, rel=1e-6)


def test_a_unit_that_is_given_is_not_guessed(file, capsys):
    found, code, _ = checked(capsys, file, "--scale", "0.01")
    assert code == EXIT_OK
    assert not found["scale_is_guessed"]
    assert found["box"][1] == pytest.approx([0.4, 0.4, 0.2])
    assert "scale is -1" in checked_error(capsys, file, "--scale=-1")


def checked_error(capsys, *words):
    """Return the error of the command, which prints nothing else."""
    assert command_line(["check", *map(str, words)]) == EXIT_WRONG_USE
    printed = capsys.readouterr()
    assert printed.out == ""
    return printed.err


def test_a_mesh_that_is_refused_is_described_before_its_fault_is_named(tmp_path, capsys):
    flat = MESH.positions.copy()
    flat[MESH.tetrahedra[0, 0]] = flat[MESH.tetrahedra[0, 1]]
    path = tmp_path / "flat.msh"
    path.write_bytes(write.gmsh_2(MESH._replace(positions=flat)))
    found, code, error = checked(capsys, path)
    assert code == EXIT_WRONG_USE
    assert found["cells"]["tetrahedra"] == 192
    assert found["shape"] is None and found["speed"] is None
    assert "flat tetrahedra" in found["fault"] and found["fault"] in error


def test_a_surface_is_refused_with_what_to_do(tmp_path, capsys):
    surface = meshio.Mesh(np.eye(3), [("triangle", [[0, 1, 2]])])
    surface.write(tmp_path / "skin.stl")
    assert "only a surface" in checked_error(capsys, tmp_path / "skin.stl")


def test_what_is_divided_and_repaired_is_noted_on_the_page(tmp_path, capsys):
    points = 0.01 * np.array(
        [[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]]
    )
    cube = meshio.Mesh(np.vstack([points, [5.0, 5.0, 5.0]]), [("hexahedron", [list(range(8))])])
    cube.write(tmp_path / "cube.vtu")
    report = report_on_mesh(tmp_path / "cube.vtu")
    print_mesh(tmp_path / "cube.vtu", report, Speed(2.5e-3, 0.034), Console(width=100))
    text = capsys.readouterr().out
    for line in (
        r"contains +9 nodes, 1 hexahedra",
        r"unit +metres, guessed by its extent: --scale 1\b",
        r"body +8 nodes, 6 tetrahedra, 1 piece",
        r"note +1 hexahedra divided into 6 tetrahedra",
        r"note +dropped 1 node that no tetrahedron uses",
        r"time step +2.5 ms, the longest that is stable without a blade",
        r"real time +0.034 times as fast as real time, within a factor of 2",
    ):
        assert re.search(line, text), (line, text)


def measures_of(name):
    """Return the measures of the body of a scene."""
    scene = SCENES[name]
    how = scene.solver
    settings = SolverSettings(
        scheme=how.scheme,
        relaxation=how.relaxation,
        element=how.element,
        precision=how.precision,
        mass_scaling=how.mass_scaling or None,
    )
    return Tissue(scene.mesh(), scene.material, solver=settings).cut_report().initial


UNIFORM = [name for name in sorted(scene_costs()) if len(SCENES[name].all_materials) == 1]
"""Scenes of one material, which is what the command is told."""


@pytest.mark.parametrize("name", UNIFORM)
def test_the_factor_of_each_scene_is_that_which_was_measured_within_a_factor_of_two(name):
    reference = 1e-3
    expected = expected_factors(reference, scene_costs())[name]
    found = factor_of_body(reference, measures_of(name))
    assert found == pytest.approx(MILLISECOND / (cost_of_body(measures_of(name)) * reference))
    assert 1 / 2.1 < found / expected < 2.1


def test_the_real_time_factor_is_there_where_kernels_are(file, capsys):
    compile_ahead([KernelSet.of(as_run(SCENES[DEFAULT_SCENE]))])
    found, _, _ = checked(capsys, file)
    assert found["speed"]["real_time_factor"] > 0.0
