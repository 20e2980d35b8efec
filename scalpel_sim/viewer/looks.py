"""Looks of bodies by material: their colours outside and inside, vessels, fibres and rim."""

from typing import NamedTuple

from scalpel_sim.scene.label_colours import LabelColours, colours_of_scene
from scalpel_sim.scene.scene import Scene
from tissue import MATERIALS, Material

Ramp = tuple[tuple[float, str], ...]
"""Colours from deep to high: position along the ramp, from 0 to 1, and sRGB colour."""


class Look(NamedTuple):
    """The look of a material."""

    skin: Ramp
    """Colours outside."""
    inside: Ramp
    """Colours of the faces of a cut."""
    vessels: float = 1.0
    """Depth of the vessels in the skin, over that in the skin of an organ."""
    fibres: float = 1.0
    """Depth of the fibres inside, over that in an organ."""
    rim: float = 0.2
    """Share by which the inside is darker than its rim at the skin, the capsule; below 0 the rim is
    the darker one."""
    variation: float = 1.0
    """Variation of the colour from place to place, over that in an organ."""
    translucency: float = 0.0
    """Share of the light that goes through, where a graphics card draws."""
    glow: int = 0x3A0A0E
    """Light scattered between the faces of a cut, 0xRRGGBB. Without it a narrow cut looks black."""
    labels: tuple[LabelColours, ...] = ()
    """Of a body with several labels the colours of each, which its pale ramps are factors of."""


ORGAN_LOOK = Look(
    skin=((0.0, "4d1613"), (0.3, "7d2a22"), (0.55, "9c3f32"), (0.8, "b3574a"), (1.0, "cc7d6c")),
    inside=((0.0, "4e070c"), (0.35, "8a1518"), (0.65, "b2322d"), (0.9, "d2695b"), (1.0, "f0b3a0")),
)
"""A soft organ, from deep vessels to its thin capsule, and from the blood between fibres to bare
fibres: the look of all materials but those below."""

PALE: Ramp = ((0.0, "6e6462"), (0.3, "b9b1ae"), (0.55, "e6e2e0"), (0.8, "f4f2f1"), (1.0, "ffffff"))
"""Ramp of a texture whose colour comes from labels. Its middle is bright: it is a factor."""

LABELLED_LOOK = Look(
    skin=PALE, inside=PALE, vessels=0.3, fibres=0.7, rim=0.12, variation=0.5, glow=0x20120E
)
"""A body of several labels, before it has their colours."""

LOOKS = {
    "liver": Look(
        skin=((0.0, "35100e"), (0.4, "672820"), (0.7, "863b2e"), (1.0, "ab6c5c")),
        inside=((0.0, "3a070a"), (0.4, "781b19"), (0.7, "9d382e"), (1.0, "c87e6a")),
        vessels=0.5,
        fibres=0.5,
        glow=0x240709,
    ),
    "kidney": Look(
        skin=((0.0, "3e120f"), (0.4, "6c2a22"), (0.7, "87402f"), (1.0, "ad6e58")),
        inside=((0.0, "4a0d10"), (0.4, "8c2c28"), (0.7, "ad5348"), (1.0, "d99a86")),
        rim=0.35,
        glow=0x300A0C,
    ),
    "skin": Look(
        skin=((0.0, "a8705a"), (0.4, "cf9b82"), (0.7, "deb298"), (1.0, "edcdb6")),
        inside=((0.0, "9c4a3c"), (0.4, "cf8a6a"), (0.7, "e0b27c"), (1.0, "f2dba6")),
        vessels=0.15,
        fibres=0.5,
        rim=-0.25,
        variation=0.4,
        glow=0x3A1A10,
    ),
    "fat": Look(
        skin=((0.0, "a87b2c"), (0.4, "d6ab4c"), (0.7, "e6c46c"), (1.0, "f4dfa0")),
        inside=((0.0, "b0812e"), (0.4, "dcb254"), (0.7, "ecca76"), (1.0, "f8e6ae")),
        vessels=0.4,
        fibres=0.4,
        rim=0.08,
        variation=0.5,
        glow=0x33240A,
    ),
    "muscle": Look(
        skin=((0.0, "50100f"), (0.4, "842220"), (0.7, "a23a34"), (1.0, "cf8474")),
        inside=((0.0, "4a080a"), (0.4, "8a1a1a"), (0.7, "b03a34"), (1.0, "e09484")),
        vessels=0.3,
        fibres=2.0,
    ),
    "gelatin": Look(
        skin=((0.0, "b8863a"), (0.5, "d2a350"), (1.0, "e6c27a")),
        inside=((0.0, "c08f40"), (0.5, "d8ac5a"), (1.0, "ecca86")),
        vessels=0.0,
        fibres=0.15,
        rim=0.0,
        translucency=0.75,
        variation=0.15,
        glow=0x3A2408,
    ),
    "silicone": Look(
        skin=((0.0, "b9b6ae"), (0.5, "d0cdc4"), (1.0, "e4e2da")),
        inside=((0.0, "bdbab2"), (0.5, "d4d1c9"), (1.0, "e8e6df")),
        vessels=0.0,
        fibres=0.1,
        rim=0.0,
        translucency=0.25,
        variation=0.15,
        glow=0x24221E,
    ),
}
"""Looks of materials by their names in `tissue.MATERIALS`."""


def look_of_scene(scene: Scene) -> Look:
    """Return the look of a scene's body: of its material, or of its labels, if it has several."""
    labels = colours_of_scene(scene)
    return LABELLED_LOOK._replace(labels=labels) if labels else look_of(scene.material)


def look_of(material: Material) -> Look:
    """Return the look of a material: of the tissue by name that is as stiff and as heavy."""
    for name, look in LOOKS.items():
        tissue = MATERIALS[name].material
        if (tissue.young_modulus, tissue.density) == (material.young_modulus, material.density):
            return look
    return ORGAN_LOOK
