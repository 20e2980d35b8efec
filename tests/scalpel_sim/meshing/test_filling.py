"""Surfaces are filled with tetrahedra that can be cut, within the limits that were given."""

import importlib.util
import json
import sys

import numpy as np
import pytest
import trimesh

from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE, RunError, UsageError
from scalpel_sim.meshing.filling import fill
from scalpel_sim.meshing.limited_process import ProcessLimits, limited_process
from scalpel_sim.meshing.sizes import TOLERANCE_OF_SIZE
from tests.support import surfaces
from tissue import read_mesh
from tissue.mesh.faces import boundary_faces
from tissue.mesh.validation import quality, signed_volumes

pytestmark = pytest.mark.skipif(
    importlib.util.find_spec("pytetwild") is None, reason="the extra `mesh` is not installed"
)

COARSE = 0.02
"""Edge length of quick meshes [m]."""


def filled(mesh, folder, **options):
    mesh.export(folder / "body.stl")
    return fill(folder / "body.stl", **options)


def test_a_ball_is_filled_within_the_tolerance(tmp_path):
    made = filled(surfaces.ball(), tmp_path, edge_length=COARSE)
    mesh, tolerance = made.mesh, made.sizes.tolerance
    skin = trimesh.Trimesh(mesh.positions, boundary_faces(mesh.tetrahedra))
    radii = np.linalg.norm(skin.triangles_center, axis=1)
    lowest = np.linalg.norm(surfaces.ball().triangles_center, axis=1).min()
    assert lowest - tolerance <= radii.min() <= radii.max() <= 0.05 + tolerance
    assert signed_volumes(mesh.positions, mesh.tetrahedra).sum() == pytest.approx(
        surfaces.ball().volume, rel=0.03
    )
    assert quality(mesh.positions, mesh.tetrahedra).min() > 0.15


@pytest.mark.parametrize("name", ["facing either way", "hollow", "touching in an edge"])
def test_a_bad_surface_becomes_a_sound_mesh(name, tmp_path):
    mesh = filled(surfaces.FILLED[name](), tmp_path, edge_length=COARSE).mesh
    assert quality(mesh.positions, mesh.tetrahedra).min() > 0.1


def test_a_rim_that_the_mesher_rounds_is_filled_again_until_it_is_kept(tmp_path):
    made = filled(surfaces.pressed_flat(), tmp_path, edge_length=COARSE)
    assert made.moved <= made.bound == TOLERANCE_OF_SIZE * made.surface.size()
    assert made.sizes.tolerance < made.bound  # the envelope of the mesher had to be closer
    rim = made.surface.vertices[np.abs(made.surface.vertices[:, 2]) < 1e-6]
    skin = trimesh.Trimesh(made.mesh.positions, boundary_faces(made.mesh.tetrahedra))
    assert trimesh.proximity.closest_point_naive(skin, rim)[1].max() <= made.bound


def test_walls_inside_a_body_of_parts_that_overlap_do_not_count(tmp_path):
    made = filled(surfaces.FILLED["overlapping"](), tmp_path, edge_length=COARSE)
    assert made.moved <= made.bound


def test_by_itself_a_mesh_has_some_five_thousand_tetrahedra(tmp_path):
    assert len(filled(surfaces.ball(), tmp_path).mesh.tetrahedra) == pytest.approx(5_000, rel=0.3)


def test_a_mesher_that_takes_too_long_is_ended_and_its_log_kept(tmp_path):
    with pytest.raises(RunError, match=r"took more than 0\.3 s.*see /.*log\.txt"):
        filled(surfaces.ball(), tmp_path, limits=ProcessLimits(time=0.3))


@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited on Linux alone")
def test_a_process_that_wants_more_memory_than_it_may_is_ended():
    with (
        pytest.raises(RunError, match=r"needs more than 1 GB; --memory-limit"),
        limited_process(
            "tests.support.hungry", [], "eating", ProcessLimits(memory=1.0), lambda *_: None
        ),
    ):
        pass


def test_a_refusal_comes_from_the_other_process_as_it_is(tmp_path):
    with pytest.raises(UsageError, match="form no closed surface"):
        filled(surfaces.soup(), tmp_path)


def test_the_command_writes_a_mesh_and_tells_what_it_made(tmp_path, capsys):
    surfaces.ball(50.0).export(tmp_path / "body.stl")
    out = tmp_path / "body.vtu"
    asked = ["mesh", str(tmp_path / "body.stl"), "-o", str(out), "--edge-length", str(COARSE)]
    assert command_line(asked) == EXIT_WRONG_USE
    assert "--scale 0.001" in capsys.readouterr().err
    assert command_line([*asked, "--scale", "0.001", "--json"]) == EXIT_OK
    told = json.loads(capsys.readouterr().out)
    mesh = read_mesh(out)
    assert told["n_tetrahedra"] == len(mesh.tetrahedra)
    assert told["width"] == pytest.approx([0.1] * 3, rel=0.02)
    assert told["volume"] == pytest.approx(
        signed_volumes(mesh.positions, mesh.tetrahedra).sum(), rel=1e-12
    )
    assert command_line([*asked, "--scale", "0.001"]) == EXIT_WRONG_USE
    assert "exists already" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["body.stl", "body.nii.gz", "body.msh"])
def test_a_file_that_stands_for_another_is_told_as_such(name, tmp_path, capsys):
    (tmp_path / name).write_bytes(b"version https://git-lfs.github.com/spec/v1\noid sha256:4c\n")
    assert command_line(["mesh", str(tmp_path / name)]) == EXIT_WRONG_USE
    assert "fetch the file itself with `git lfs pull`" in capsys.readouterr().err
