"""Colours of labels: by the scene, by name, by material, else such that all can tell them apart."""

import itertools

import numpy as np
import pytest

from scalpel_sim.scene.label_colours import PALETTE, colours_of_labels, colours_of_scene
from scalpel_sim.scene.read import SCENES, read_scene
from tissue import MATERIALS, Material, block

MESH = block((4, 2, 2), (0.04, 0.02, 0.02))
N = len(MESH.tetrahedra)

SEEN_BY = {
    "deuteranopes": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "protanopes": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "others": np.eye(3),
}
"""Linear light as people see it (Machado, Oliveira, Fernandes, 2009, severity 1)."""

CLEARLY_OTHER = 10.0
"""Distance in CIE Lab from which on two colours beside each other are told apart at a glance; 2.3
is just noticeable."""


def colours(names, given=(), materials=None):
    mesh = MESH._replace(labels=np.arange(N) % 3, label_names=names)
    return colours_of_labels(mesh, dict(given), materials or {None: Material()})


def test_a_body_of_one_label_has_no_colours_of_labels():
    assert colours_of_labels(MESH, {}, {None: Material()}) == ()
    one = MESH._replace(labels=np.full(N, 4), label_names={4: "fat"})
    assert colours_of_labels(one, {}, {None: Material()}) == ()


def test_names_say_the_colours_that_a_surgeon_expects():
    _, artery, fat = colours({1: "left hepatic artery", 2: "Fat_2"})
    assert [each.title for each in (artery, fat)] == ["left hepatic artery", "Fat_2"]
    red, green, blue = bytes.fromhex(artery.skin)
    assert red > 2 * green and red > 2 * blue
    red, green, blue = bytes.fromhex(fat.skin)
    assert red > green > 1.5 * blue
    assert colours({1: "liver vessels"})[1].skin == colours({1: "vessel"})[1].skin


def test_the_scene_decides_before_name_and_material():
    names = {1: "artery", 2: "lining"}
    _, artery, lining = colours(names, {"artery": "#00FF00"}, {None: MATERIALS["fat"].material})
    assert (artery.skin, artery.inside) == ("00ff00", "00ff00")
    assert lining.skin in PALETTE, "the rest has the colour of fat already"


def test_what_has_no_name_has_that_of_its_material_or_its_number():
    rest, first, _ = colours({2: "skin"}, (), {None: MATERIALS["muscle"].material})
    assert (rest.title, first.title) == ("muscle", "label 1")
    assert colours({})[0].title == "the rest"


def lab(colour, seen):
    """Return a colour in CIE Lab as someone sees it."""
    shares = np.array(list(bytes.fromhex(colour))) / 255.0
    linear = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = to_xyz @ np.clip(np.array(seen) @ linear, 0.0, 1.0) / [0.9505, 1.0, 1.089]
    x, y, z = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16.0 / 116.0)
    return np.array([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])


def closest(chosen, seen):
    return min(
        np.linalg.norm(lab(a, seen) - lab(b, seen)) for a, b in itertools.combinations(chosen, 2)
    )


@pytest.mark.parametrize("seen", SEEN_BY.values(), ids=SEEN_BY)
def test_colours_are_told_apart_by_people_who_see_less_of_them(seen):
    assert closest(PALETTE, seen) > CLEARLY_OTHER
    for name in ("layers", "tumour"):
        found = colours_of_scene(SCENES[name])
        assert closest([each.skin for each in found], seen) > CLEARLY_OTHER
        assert closest([each.inside for each in found], seen) > CLEARLY_OTHER


def test_a_colour_in_a_scene_file_is_six_hexadecimal_digits(tmp_path):
    path = tmp_path / "two.toml"
    text = (
        '[body]\nshape = "block"\ncells = [2, 2, 2]\nsize = [0.02, 0.02, 0.02]\n'
        '[[label]]\nname = "low"\nregion = "0,0,0:0.02,0.02,0.01"\ncolour = "{}"\n'
    )
    path.write_text(text.format("#12Ab9f"))
    assert colours_of_scene(read_scene(path))[1].skin == "12ab9f"
    path.write_text(text.format("red"))
    with pytest.raises(ValueError, match="#rrggbb"):
        read_scene(path)
