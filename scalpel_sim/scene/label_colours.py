"""Colours of the parts of a body: one choice for pages, figures and exports."""

import re
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from scalpel_sim.scene.labels import full_name
from scalpel_sim.scene.scene import Scene
from tissue import MATERIALS, Material, TetrahedralMesh

UNNAMED = "the rest"
"""Title of label 0, if it has no name and its material none."""

_BY_WORD = {
    ("artery", "aorta", "vessel", "blood"): ("b3202a", "8c1119"),
    ("vein", "cava"): ("41519c", "2f3c7d"),
    ("nerve",): ("f0d64a", "e6cc52"),
    ("duct", "bile", "gallbladder"): ("71904f", "8aa35c"),
    ("liver", "parenchyma"): ("863b2e", "9d382e"),
    ("kidney",): ("87402f", "ad5348"),
    ("spleen",): ("5b2438", "74304a"),
    ("fat", "adipose"): ("e6c46c", "ecca76"),
    ("skin", "epidermis", "dermis"): ("deb298", "e0b27c"),
    ("muscle",): ("a23a34", "b03a34"),
    ("bone", "stone", "tooth"): ("ece3cf", "e6dabd"),
    ("cartilage",): ("bfd6de", "c9dde4"),
    ("tendon", "ligament", "fascia", "capsule", "membrane"): ("dcd6c8", "e4dfd3"),
    ("tumour", "tumor", "lesion", "lump", "nodule"): ("93807d", "b09a96"),
    ("gelatin", "gel"): ("d2a350", "d8ac5a"),
    ("silicone",): ("d0cdc4", "d4d1c9"),
}
"""Colours outside and inside, in sRGB, that a surgeon expects by words in a name."""

_EXPECTED = {word: pair for words, pair in _BY_WORD.items() for word in words}

PALETTE = ("e69f00", "56b4e9", "009e73", "f0e442", "0072b2", "d55e00", "cc79a7")
"""Colours of labels of which neither name nor material says one, in turn. People who are
colour-blind can tell them apart: M. Okabe, K. Ito, "Color Universal Design", 2008."""


class LabelColours(NamedTuple):
    """The colours of one label of a body."""

    label: int
    """The label."""
    title: str
    """Name that a person reads."""
    skin: str
    """Colour outside in sRGB: six hexadecimal digits."""
    inside: str
    """Colour of the faces of a cut."""


class TissueColours(NamedTuple):
    """Even colours of a body, for programs that have no textures of ours."""

    skin: str = "9c3f32"
    """Colour outside in sRGB: six hexadecimal digits."""
    inside: str = "d4443c"
    """Colour of the faces of a cut."""
    labels: Sequence[LabelColours] = ()
    """Of a body with several labels the colours of each, in their place."""


def colours_of_scene(scene: Scene) -> tuple[LabelColours, ...]:
    """Return the colours of the labels of a scene's body; none of a body with one label."""
    mesh = scene.mesh()
    given = {full_name(row): row.colour for row in scene.labels if row.colour is not None}
    materials = scene.materials
    return colours_of_labels(
        mesh, given, materials if isinstance(materials, Mapping) else {None: materials}
    )


def colours_of_labels(
    mesh: TetrahedralMesh,
    given: Mapping[str, str],
    materials: Mapping[int | str | None, Material],
) -> tuple[LabelColours, ...]:
    """Return the colours of the labels of a mesh, in the order of labels; none where there is one.

    A label has the colour that is given; or that of the tissue which its name says; or that of the
    tissue which its material is, if no other label has it; or the next one of `PALETTE`.

    Args:
        mesh: The mesh.
        given: Colours of labels by their names, "#rrggbb".
        materials: Materials of labels by their names, and of the rest (None).
    """
    labels: Sequence[int] = [] if mesh.labels is None else np.unique(mesh.labels).tolist()
    if len(labels) < 2:
        return ()
    tissues = {n: _tissue_of(_material_of(mesh.label_names.get(n), materials)) for n in labels}
    found: dict[int, tuple[str, str]] = {}
    for label in labels:
        name = mesh.label_names.get(label, "")
        own = given.get(name)
        pair = _expected(name.rpartition("/")[2]) if own is None else (own[1:].lower(),) * 2
        if pair is not None:
            found[label] = pair
    palette = iter(PALETTE * (len(labels) // len(PALETTE) + 1))
    for label in labels:
        if label not in found:
            pair = _expected(tissues[label])
            if pair is None or pair in found.values():
                pair = (next(palette),) * 2
            found[label] = pair
    return tuple(
        LabelColours(n, mesh.label_names.get(n) or _title(n, tissues[n]), *found[n]) for n in labels
    )


def _material_of(
    name: str | None, materials: Mapping[int | str | None, Material]
) -> Material | None:
    """Return the material of a label: its own, that of its body, or of the rest."""
    rest = materials.get(None)
    if name is None:
        return rest
    return materials.get(name, materials.get(name.partition("/")[0], rest))


def _title(label: int, tissue: str) -> str:
    """Return the title of a label without a name."""
    if label == 0:
        return tissue or UNNAMED
    return f"label {label}"


def _expected(name: str) -> tuple[str, str] | None:
    """Return the colours that a name says; of several words the last, as in `liver vessel`."""
    for word in reversed(re.findall(r"[a-z]+", name.lower())):
        pair = _EXPECTED.get(word) or _EXPECTED.get(word.removesuffix("s"))
        if pair is not None:
            return pair
    return None


def _tissue_of(material: Material | None) -> str:
    """Return the name of the tissue that is as stiff and as heavy as a material; "" for none."""
    for name, preset in MATERIALS.items():
        tissue = preset.material
        if material is not None and (tissue.young_modulus, tissue.density) == (
            material.young_modulus,
            material.density,
        ):
            return name
    return ""
