"""The specimen of every material by name is cut in two, as asked, in the material's own figures."""

import itertools

import pytest

from bridge import InProcessLink
from scalpel_sim import SCENES, prepare
from scalpel_sim.scene_body import make_tissue
from scalpel_sim.scene_parts.specimens import SPECIMENS
from tissue import MATERIALS, BladeSweep, pieces_of

NEAR = 0.05
"""Largest relative error of the area of a cut."""

DT = 1e-3


def test_every_material_by_name_has_a_specimen_of_that_name():
    assert list(SPECIMENS) == list(MATERIALS)
    for name in SPECIMENS:
        assert SCENES[name].material == MATERIALS[name].material


@pytest.mark.parametrize("name", SPECIMENS)
def test_a_specimen_is_cut_in_two_and_nothing_else(name, caplog):
    scene, specimen = SCENES[name], SPECIMENS[name]
    tissue = make_tissue(scene)
    stroke = prepare(scene, InProcessLink(tissue, name)).stroke
    assert not caplog.records  # an arm can do it
    poses = stroke.poses(round(stroke.duration / DT) + 1)
    for before, after in itertools.pairwise(poses):
        result = tissue.step(BladeSweep(before, after), DT)
    section = sum(specimen.across) * sum(specimen.layers)
    assert result.cut_area == pytest.approx(section, rel=NEAR)
    assert result.finished_area < NEAR * section
    pieces = pieces_of(tissue.snapshot())
    assert len(pieces) == 2 and all(piece.is_held for piece in pieces)
    assert tissue.cut_report().now.inverted == 0.0


def test_what_is_said_of_a_specimen_is_its_size():
    for specimen in SPECIMENS.values():
        sizes = (specimen.along, specimen.across, specimen.layers)
        extent = " x ".join(f"{1e3 * sum(size):.3g}" for size in sizes)
        area = 1e6 * sum(specimen.across) * sum(specimen.layers)
        assert f"{extent} mm" in specimen.about
        assert f"{area:,.0f} mm²" in specimen.about
        assert specimen.mesh().positions.max(axis=0) == pytest.approx([sum(size) for size in sizes])
