import io

import numpy as np
import pytest
from PIL import Image

from scalpel_sim.viewer import textures


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


def test_the_inside_is_brighter_and_redder_than_the_skin():
    skin = decoded(textures.skin()).mean(axis=(0, 1))
    inside = decoded(textures.cut_face()).mean(axis=(0, 1))
    assert inside[0] > 1.2 * skin[0]
    assert inside[0] / inside[1] > 1.2 * skin[0] / skin[1]


def test_cut_faces_are_striated_and_skin_is_not():
    def anisotropy(picture):
        across, along = (np.abs(np.diff(picture, axis=axis)).mean() for axis in (0, 1))
        return across / along

    assert anisotropy(decoded(textures.cut_face())) > 1.5
    assert 0.8 < anisotropy(decoded(textures.skin())) < 1.25


def test_the_table_fades_to_nothing_at_its_rim():
    disc = decoded(textures.fading_disc())[:, :, 0]
    assert disc[128, 128] == 255
    assert disc[0].max() == disc[:, 0].max() == 0
