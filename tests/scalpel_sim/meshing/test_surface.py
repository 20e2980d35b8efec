"""A surface is read, tidied, and refused in one sentence where it encloses no body."""

import numpy as np
import pytest

from scalpel_sim.errors import UsageError
from scalpel_sim.meshing.sizes import chosen_sizes
from scalpel_sim.meshing.surface import read_surface, with_notes_on_holes
from tests.support import surfaces


def stl_of(mesh, folder):
    mesh.export(folder / "body.stl")
    return folder / "body.stl"


@pytest.mark.parametrize("name", surfaces.REFUSED)
def test_a_surface_without_a_body_is_refused_in_one_sentence(name, tmp_path):
    made, said = surfaces.REFUSED[name]
    with pytest.raises(UsageError, match=said):
        read_surface(stl_of(made(), tmp_path), None)


@pytest.mark.parametrize("name", surfaces.FILLED)
def test_a_surface_with_faults_that_encloses_a_body_is_taken(name, tmp_path):
    surface = read_surface(stl_of(surfaces.FILLED[name](), tmp_path), None)
    assert surface.volume() > 0.0
    assert chosen_sizes(surface, None, None).tolerance <= 0.005 * surface.size()


def binary():
    return surfaces.ball().export(file_type="stl")


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("empty.stl", lambda: b"", "it is empty"),
        ("page.stl", lambda: b"<!DOCTYPE html>" + 90 * b" ", "is no STL file"),
        ("short.stl", lambda: binary()[:3000], "cut short"),
        ("lying.stl", lambda: binary()[:80] + b"\xff" * 4 + binary()[84:], "cut short"),
        ("nan.stl", lambda: binary()[:96] + b"\xff" * 12 + binary()[108:], "NaN or infinite"),
        ("text.obj", lambda: b"what is this", "no triangles"),
        ("outside.obj", lambda: b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "OBJ file|names vertex"),
        ("short.glb", lambda: surfaces.ball().export(file_type="glb")[:900], "no GLB file"),
        (
            "points.ply",
            lambda: b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n",
            "PLY|no tri",
        ),
    ],
)
def test_a_file_that_is_broken_is_refused_in_one_sentence(name, data, said, tmp_path):
    (tmp_path / name).write_bytes(data())
    with pytest.raises(UsageError, match=said):
        read_surface(tmp_path / name, 1.0)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb"])
def test_every_format_gives_the_same_body(suffix, tmp_path):
    surfaces.ball().export(tmp_path / f"body.{suffix}")
    surface = read_surface(tmp_path / f"body.{suffix}", None)
    assert surface.volume() == pytest.approx(surfaces.ball().volume, rel=1e-6)
    assert surface.area() == pytest.approx(surfaces.ball().area, rel=1e-6)
    assert len(surface.vertices) == len(surfaces.ball().vertices)
    assert surface.notes == ()


def test_what_is_mended_is_told(tmp_path):
    mesh = surfaces.ball()
    faces = np.vstack([mesh.faces[3:], mesh.faces[5:6], mesh.faces[:1, [0, 0, 1]]])
    file = stl_of(surfaces.of(mesh.vertices, faces), tmp_path)
    assert with_notes_on_holes(read_surface(file, 1.0)).notes == (
        "dropped 1 triangles without an area",
        "dropped 1 triangles that are there twice",
        "closed the surface along 9 open edges",
    )


def test_a_scale_makes_metres_and_an_impossible_one_is_refused(tmp_path):
    file = stl_of(surfaces.ball(50.0), tmp_path)
    assert read_surface(file, 0.001).size() == pytest.approx(surfaces.ball().scale, rel=1e-6)
    with pytest.raises(UsageError, match=r"the body is 1e\+05 m wide"):
        read_surface(file, 1000.0)
    with pytest.raises(UsageError, match="--scale is -1"):
        read_surface(file, -1.0)
