import io

import numpy as np
import pytest
from PIL import Image

from scalpel_sim.viewer import textures
from scalpel_sim.viewer.looks import LOOKS, ORGAN_LOOK, look_of
from scalpel_sim.viewer.textures import map_texture
from tests.scalpel_sim.cut_block import cut_block
from tests.scalpel_sim.real_cut import cut_tissue
from tissue import MATERIALS, Material, Surface, liver_lobe
from tissue.mesh.faces import boundary_faces

TILE = 0.02
"""[m]."""


def decoded(png: bytes) -> np.ndarray:
    """Return red, green and blue as another program reads them, shape (height, width, 3)."""
    return np.asarray(Image.open(io.BytesIO(png)).convert("RGB"), dtype=float)


@pytest.fixture(params=[textures.skin, textures.cut_face], ids=["skin", "cut_face"])
def picture(request):
    return decoded(request.param())


def test_a_texture_is_a_square_picture_that_other_programs_read(picture):
    assert picture.shape == (textures.TEXTURE_PIXELS, textures.TEXTURE_PIXELS, 3)


def test_a_texture_repeats_without_a_seam(picture):
    for axis in (0, 1):
        steps = np.abs(picture - np.roll(picture, 1, axis=axis)).mean(axis=(1 - axis, 2))
        assert steps[0] < 1.5 * np.median(steps), "the first row follows on the last"


def test_cut_faces_are_striated_and_skin_is_not():
    def anisotropy(picture):
        across, along = (np.abs(np.diff(picture, axis=axis)).mean() for axis in (0, 1))
        return across / along

    assert anisotropy(decoded(textures.cut_face())) > 1.5
    assert 0.8 < anisotropy(decoded(textures.skin())) < 1.25


def test_each_tissue_by_name_has_a_look_of_its_own_however_tough_it_is():
    for name, look in LOOKS.items():
        tissue = MATERIALS[name].material
        assert look_of(tissue) is look_of(tissue.changed(toughness=7.0)) is look
    assert look_of(Material()) is ORGAN_LOOK


def test_gelatin_is_even_and_has_no_vessels():
    spread = [
        decoded(textures.skin(look)).std(axis=(0, 1)).max()
        for look in (LOOKS["gelatin"], ORGAN_LOOK)
    ]
    assert spread[0] < 0.3 * spread[1]


@pytest.mark.parametrize("name", ["liver", "skin"])
def test_the_faces_of_a_cut_have_a_rim_of_another_shade_at_the_skin(name):
    surface, look = cut_tissue()[2], LOOKS[name]
    cut = map_texture(surface, 0.02, look=look).cut
    plain = map_texture(surface, 0.02, look=look._replace(rim=0.0)).cut
    shades = (cut.tints / plain.tints).mean(axis=1)
    of_skin = surface.positions[np.unique(surface.triangles[~surface.is_cut])]
    at_rim = (cut.positions[:, None] == of_skin).all(axis=2).any(axis=1)
    assert at_rim.any() and not at_rim.all()
    dark, pale = (at_rim, ~at_rim) if look.rim < 0 else (~at_rim, at_rim)
    assert shades[dark] == pytest.approx(1.0 - abs(look.rim)) and shades[pale] == pytest.approx(1.0)


def test_the_table_fades_to_nothing_at_its_rim():
    disc = decoded(textures.fading_disc())[:, :, 0]
    assert disc[128, 128] == 255
    assert disc[0].max() == disc[:, 0].max() == 0


def surface_of(mesh) -> Surface:
    triangles = boundary_faces(mesh.tetrahedra)
    return Surface(mesh.positions, mesh.positions, triangles, np.zeros(len(triangles), bool))


def corners(points, triangles):
    """Return the corners of triangles in an order that does not depend on that of the triangles."""
    rows = points[triangles].reshape(len(triangles), -1)
    return rows[np.lexsort(rows.T)]


def test_skin_and_cut_faces_together_are_the_surface():
    block = cut_block(0.01)
    textured = map_texture(block, TILE)
    for mesh, chosen in ((textured.skin, ~block.is_cut), (textured.cut, block.is_cut)):
        ours = corners(mesh.positions, mesh.triangles)
        assert np.array_equal(ours, corners(block.positions, block.triangles[chosen]))


def test_texture_sticks_to_the_material():
    whole = cut_block(0.01)
    bent = whole._replace(positions=whole.positions + 0.3 * np.sin(80.0 * whole.positions))
    assert np.array_equal(map_texture(bent, TILE).skin.uv, map_texture(whole, TILE).skin.uv)
    assert np.array_equal(map_texture(bent, TILE).skin.tints, map_texture(whole, TILE).skin.tints)
    assert not np.array_equal(
        map_texture(bent, TILE).skin.normals, map_texture(whole, TILE).skin.normals
    )


def test_one_tile_of_texture_covers_one_tile_of_a_flat_side():
    skin = map_texture(cut_block(0.0), TILE).skin
    edges = skin.positions[skin.triangles] - np.roll(skin.positions[skin.triangles], 1, axis=1)
    on_texture = skin.uv[skin.triangles] - np.roll(skin.uv[skin.triangles], 1, axis=1)
    assert np.allclose(
        np.linalg.norm(edges, axis=2), TILE * np.linalg.norm(on_texture, axis=2), atol=1e-12
    )


def test_texture_is_nowhere_stretched_to_more_than_the_square_root_of_three():
    skin = map_texture(surface_of(liver_lobe()), TILE).skin
    a, b, c = (skin.positions[skin.triangles[:, i]] for i in range(3))
    area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    u, v, w = (skin.uv[skin.triangles[:, i]] * TILE for i in range(3))
    on_texture = np.abs(np.linalg.det(np.stack([v - u, w - u], axis=1)))
    assert (area / on_texture).max() < np.sqrt(3.0) + 1e-9


def test_a_block_keeps_its_edges_when_it_is_turned():
    turn, _ = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))
    turn *= np.sign(np.linalg.det(turn))
    block = cut_block(0.0)
    skin = map_texture(block._replace(positions=block.positions @ turn.T), TILE).skin
    assert np.allclose(np.sort(np.abs(skin.normals @ turn), axis=1), [0.0, 0.0, 1.0], atol=1e-9)


def test_an_organ_is_smooth_across_charts():
    surface = surface_of(liver_lobe())
    skin = map_texture(surface, TILE).skin
    places, which = np.unique(skin.positions, axis=0, return_inverse=True)
    assert len(places) < len(skin.positions), "there are charts that meet"
    of_first = np.zeros((len(places), 3))
    of_first[which.ravel()] = skin.normals
    agree = np.einsum("ij,ij->i", of_first[which.ravel()], skin.normals) > 0.999
    assert agree.mean() > 0.98


@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_normals_are_unit_vectors_that_point_out(gap):
    for mesh in map_texture(cut_block(gap), TILE):
        assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1.0)
        a, b, c = (mesh.positions[mesh.triangles[:, i]] for i in range(3))
        outward = np.cross(b - a, c - a)[:, None, :]
        assert (np.sum(outward * mesh.normals[mesh.triangles], axis=2) > 0.0).all()


def test_a_flat_triangle_has_a_normal_all_the_same():
    block = cut_block(0.0)
    flat = map_texture(block._replace(positions=np.zeros_like(block.positions)), TILE).skin
    assert np.isfinite(flat.normals).all()
