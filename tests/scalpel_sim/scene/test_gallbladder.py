"""The scene `gallbladder`: its mesh, and what its run does."""

import json

import numpy as np
import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK
from scalpel_sim.meshing.gallbladder import (
    COARSE_SPACING,
    LATTICE_SPACING,
    LIVER_BACK,
    MENDED_QUALITY,
    MENDED_STEP,
    MIDDLE_HEIGHT,
    PART_NAMES,
    bed_height,
    gallbladder,
    made_gallbladder,
)
from tissue import boundary_faces
from tissue.mesh.validation import checked
from tissue.support import components, quality

MESH = gallbladder()
NUMBERS = {name: label for label, name in PART_NAMES.items()}


def tetrahedra_of(name):
    return MESH.tetrahedra[NUMBERS[name] == MESH.labels]


def n_parts(tetrahedra):
    """Return the number of pieces of some tetrahedra."""
    _, tets = np.unique(tetrahedra, return_inverse=True)
    edges = tets.reshape(-1, 4)[:, [0, 1, 1, 2, 2, 3]].reshape(-1, 2)
    return components(tets.max() + 1, edges)[0]


def bed():
    """Triangles between liver and gallbladder."""
    liver, sac = (np.sort(boundary_faces(tetrahedra_of(n))) for n in ("liver", "gallbladder"))
    rows, counts = np.unique(np.concatenate([liver, sac]), axis=0, return_counts=True)
    return rows[counts == 2]


def test_the_shipped_mesh_is_the_one_that_the_code_makes():
    made = made_gallbladder()
    np.testing.assert_array_equal(made.tetrahedra, MESH.tetrahedra)
    np.testing.assert_array_equal(made.labels, MESH.labels)
    np.testing.assert_allclose(made.positions, MESH.positions, rtol=0.0, atol=1e-12)


def test_the_coarse_mesh_is_the_one_that_the_code_makes_with_the_same_parts_each_in_one_piece():
    made, mesh = made_gallbladder(COARSE_SPACING), gallbladder(coarse=True)
    np.testing.assert_array_equal(made.tetrahedra, mesh.tetrahedra)
    np.testing.assert_allclose(made.positions, mesh.positions, rtol=0.0, atol=1e-12)
    assert checked(mesh).warnings == ()
    assert len(mesh.tetrahedra) < 0.25 * len(MESH.tetrahedra)
    for label in PART_NAMES:
        assert n_parts(mesh.tetrahedra[mesh.labels == label]) == 1


def test_it_is_one_sound_body_of_four_parts_each_in_one_piece():
    assert checked(MESH).warnings == ()
    assert 3_000 <= len(MESH.tetrahedra) <= 6_000
    assert quality(MESH.positions, MESH.tetrahedra).min() >= 0.99 * MENDED_QUALITY
    for name in NUMBERS:
        assert n_parts(tetrahedra_of(name)) == 1, name


def test_gallbladder_and_liver_share_the_bed_and_the_artery_is_in_fat_beside_the_neck():
    nodes = np.unique(bed())
    x, y, z = MESH.positions[nodes].T
    way = LIVER_BACK - y - bed_height(x, z - MIDDLE_HEIGHT)
    # At the rim, where both meet the outside, a lattice cell has one corner for all three.
    assert (np.abs(way) < MENDED_STEP).mean() > 0.8 and np.abs(way).max() < LATTICE_SPACING
    assert np.ptp(x) > 0.04 and np.ptp(z) > 0.02
    artery, fat, sac = (
        set(np.unique(tetrahedra_of(n)).tolist()) for n in ("artery", "fat", "gallbladder")
    )
    assert len(artery & fat) > 10
    assert MESH.positions[sorted(artery), 0].max() < MESH.positions[sorted(sac), 0].min() + 0.003


def area_of_bed():
    a, b, c = MESH.positions[bed()].swapaxes(0, 1)
    return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()


def test_the_blade_dissects_the_gallbladder_off_its_bed_and_spares_artery_and_fat(tmp_path):
    """The stroke ends before the neck: it is to take six tenths of the bed or more.

    Half of what is dissected is a face of the gallbladder; of its wall no more is cut.
    """
    command = ["run", "gallbladder", "--relaxation", "verlet", "--quiet", "--out", str(tmp_path)]
    assert command_line(command) == EXIT_OK
    found = json.loads((tmp_path / "summary.json").read_text())
    areas = {row["name"]: row["cut_area_m2"] for row in found["labels"]}
    (layer,) = found["interfaces"]
    assert layer["area_m2"] == pytest.approx(area_of_bed(), rel=1e-6)
    assert 0.6 * area_of_bed() < layer["cut_area_m2"] < 0.8 * area_of_bed()
    assert areas["gallbladder"] == pytest.approx(0.5 * layer["cut_area_m2"], rel=0.05)
    assert areas["artery"] == areas["fat"] == 0.0
    assert abs(found["residual_of_work"]) < 0.01
    assert not any(each["kind"] == "spared" for each in found["warnings"])
    score = found["score"]
    assert score["success"] and score["terms"]["covered"] > 0.9
    # The jaws close on the fundus at 0.45 s of 3.2 s, and hold it by friction to the end.
    assert 0.7 < score["terms"]["left_held"] < 0.95 and score["terms"]["left_dropped"] == 0
