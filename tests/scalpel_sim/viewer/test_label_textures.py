"""The colours of labels on skin and cut faces."""

import functools

import numpy as np
import pytest

from scalpel_sim.scene.label_colours import LabelColours
from scalpel_sim.viewer.looks import LABELLED_LOOK
from scalpel_sim.viewer.textures import factors_of_labels, map_texture
from tests.support import strokes
from tissue import Material, Surface, Tissue, block

LABELS = (
    LabelColours(0, "muscle", "c03020", "a02018"),
    LabelColours(2, "duct", "30a040", "208030"),
    LabelColours(5, "vein", "3050c0", "2040a0"),
)
LOOK = LABELLED_LOOK._replace(labels=LABELS)
BLOCK = block((4, 3, 2), (0.04, 0.03, 0.02))
LAYERS = np.array([0, 2, 5])[
    (BLOCK.positions[BLOCK.tetrahedra].mean(axis=1)[:, 1] / 0.01).astype(int)
]
"""Labels of three layers along y."""


@functools.cache
def layers() -> Tissue:
    """Return a block of three layers, cut across all of them."""
    held = BLOCK.positions[:, 0] <= 0.005
    tissue = Tissue(BLOCK._replace(labels=LAYERS), Material(toughness=0.5), fixed=held)
    strokes.make(tissue, strokes.straight(BLOCK, 0.6))
    return tissue


def test_each_triangle_has_the_label_of_the_tetrahedron_that_it_is_a_face_of():
    for tissue in (layers(), Tissue(BLOCK._replace(labels=np.arange(len(BLOCK.tetrahedra)) % 7))):
        surface, body = tissue.surface(), tissue.snapshot()
        by_places = {
            frozenset(map(tuple, body.positions[np.delete(corners, face)].tolist())): label
            for corners, label in zip(body.tetrahedra, body.labels.tolist(), strict=True)
            for face in range(4)
        }
        outside = surface.positions[surface.triangles].tolist()
        found = [by_places[frozenset(map(tuple, each))] for each in outside]
        assert surface.labels.tolist() == found


def test_a_body_of_one_label_says_nothing_of_labels():
    assert Tissue(BLOCK).surface().labels is None


@pytest.mark.parametrize("part", ["skin", "cut"])
def test_triangles_have_the_colours_of_their_labels_and_borders_are_sharp(part):
    surface = layers().surface()
    chosen = surface.is_cut if part == "cut" else ~surface.is_cut
    plain = getattr(map_texture(surface, 0.02, look=LOOK._replace(labels=())), part)
    mesh = getattr(map_texture(surface, 0.02, look=LOOK), part)
    place = np.searchsorted([0, 2, 5], surface.labels[chosen])
    assert set(place.tolist()) == {0, 1, 2}
    outside, inside = factors_of_labels(LOOK)
    expected = (inside if part == "cut" else outside)[place][:, None]
    factors = mesh.tints[mesh.triangles] / plain.tints[plain.triangles]
    np.testing.assert_allclose(factors, np.broadcast_to(expected, factors.shape), rtol=1e-12)
    for name in ("positions", "normals", "uv"):
        mine, theirs = getattr(mesh, name), getattr(plain, name)
        assert np.array_equal(mine[mesh.triangles], theirs[plain.triangles])
    assert len(mesh.positions) > len(plain.positions), "a border has a vertex for each side"


def test_values_at_vertices_are_the_same_on_both_sides_of_a_border():
    surface = layers().surface()
    levels = {"strain": np.arange(len(surface.positions)) % 256}
    skin = map_texture(surface, 0.02, levels, LOOK).skin
    plain = map_texture(surface, 0.02, levels, LOOK._replace(labels=())).skin
    mine, theirs = skin.levels["strain"][skin.triangles], plain.levels["strain"][plain.triangles]
    assert np.array_equal(mine, theirs)


def test_colours_that_are_brighter_than_the_texture_keep_their_hue():
    white = LOOK._replace(labels=(LABELS[0]._replace(skin="ffffff"), *LABELS[1:]))
    outside, _ = factors_of_labels(white)
    assert outside.max() <= 1.0 and outside[0].min() > 0.9


def test_a_part_of_a_surface_keeps_its_labels():
    surface = layers().surface()
    chosen = surface.labels == 2
    part = surface.part(chosen)
    assert isinstance(part, Surface) and (part.labels == 2).all()
    assert np.array_equal(part.triangles, surface.triangles[chosen])
