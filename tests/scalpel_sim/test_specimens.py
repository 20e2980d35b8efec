"""The specimen of every material by name is cut in two, as asked, in the material's own figures."""

import itertools

import pytest

from bridge import InProcessLink
from scalpel_sim import SCENES, prepare
from scalpel_sim.preparation.tissue import make_tissue
from tissue import MATERIALS, BladeSweep, pieces_of

NEAR = 0.05
"""Largest relative error of the area of a cut."""

DT = 1e-3


@pytest.mark.parametrize("name", MATERIALS)
def test_a_specimen_is_cut_in_two_and_nothing_else(name, caplog):
    scene = SCENES[name]
    tissue = make_tissue(scene)
    stroke = prepare(scene, InProcessLink(tissue, name)).stroke
    assert not caplog.records  # an arm can do it
    poses = stroke.poses(round(stroke.duration / DT) + 1)
    for before, after in itertools.pairwise(poses):
        result = tissue.step(BladeSweep(before, after), DT)
    _, width, height = scene.mesh().positions.max(axis=0)
    section = width * height
    assert result.cut_area == pytest.approx(section, rel=NEAR)
    assert result.finished_area < NEAR * section
    pieces = pieces_of(tissue.snapshot())
    assert len(pieces) == 2 and all(piece.is_held for piece in pieces)
    assert tissue.cut_report().now.inverted == 0.0


@pytest.mark.parametrize("name", MATERIALS)
def test_every_material_has_a_specimen_of_its_name_and_the_size_that_is_said(name):
    scene = SCENES[name]
    assert scene.material == MATERIALS[name].material
    extent = scene.mesh().positions.max(axis=0)
    assert " x ".join(f"{1e3 * size:.3g}" for size in extent) + " mm" in scene.about
    assert f"{1e6 * extent[1] * extent[2]:,.0f} mm²" in scene.about
