"""The surface of a body as textured meshes: one for the skin of each label, one for its cut faces.

What depends on the triangles alone is kept until a cut changes them: while a body only deforms, a
picture needs new positions and normals.
"""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import numpy as np

from scalpel_sim.camera.finishes import Finish
from scalpel_sim.viewer import textures
from scalpel_sim.viewer.charts import Charts, charts_of
from scalpel_sim.viewer.looks import Look, Ramp
from scalpel_sim.viewer.primitives import TriangleMesh
from scalpel_sim.viewer.scene_packets import TILES_PER_BODY
from tissue import FloatArray, IntArray, Surface

_SKIN, _CUT = "skin", "cut"
"""Names of the outside and of the faces of cuts of a body with one label."""

_MIDDLE_TINT = 0.9
"""Factor of the colour of tissue, as the page has it on average."""

_GLOW = 0.12
"""Light that is scattered between the faces of a cut. Without it a narrow cut looks black."""


class PartKey(NamedTuple):
    """A part of a surface."""

    label: int | None
    """Label of its tetrahedra; None: the body has one."""
    is_cut: bool
    """Whether it is faces of cuts, or outside."""


def part_names(labels: Mapping[int, str]) -> dict[PartKey, str]:
    """Return the names of the parts of a body: `skin` and `cut`, or `NAME` and `cut NAME`.

    Args:
        labels: Names of its labels; none of a body with one.
    """
    if not labels:
        return {PartKey(None, False): _SKIN, PartKey(None, True): _CUT}
    names = {PartKey(label, False): name for label, name in labels.items()}
    return names | {PartKey(label, True): f"{_CUT} {name}" for label, name in labels.items()}


def part_finishes(labels: Mapping[int, str], look: Look) -> dict[str, Finish]:
    """Return the look of each part of a body, by its name.

    Args:
        labels: Names of its labels; none of a body with one.
        look: Look of its material, or of its labels.
    """
    outside = {each.label: each.skin for each in look.labels}
    inside = {each.label: each.inside for each in look.labels}
    found = {}
    for key, name in part_names(labels).items():
        ramp, colours = (look.inside, inside) if key.is_cut else (look.skin, outside)
        picture = textures.cut_face(look) if key.is_cut else textures.skin(look)
        colour = np.ones(3)
        if key.label in colours:
            colour = _factor(colours[key.label], ramp)
        red, green, blue = (_MIDDLE_TINT * colour).tolist()
        glow = _GLOW if key.is_cut else 0.0
        found[name] = Finish((red, green, blue, 1.0), picture, gloss=0.45, glow=glow)
    return found


def _factor(colour: str, ramp: Ramp) -> FloatArray:
    """Return the factor that gives the middle of a ramp a colour, at most 1."""
    middle = np.array([list(bytes.fromhex(textures.colour_at(ramp, 0.5)))], float)[0]
    factor = np.array(list(bytes.fromhex(colour)), float) / middle
    return np.asarray(factor / max(factor.max(), 1.0))


class TissueParts:
    """Makes the meshes of a body's parts.

    Args:
        labels: Names of its labels; none of a body with one.
    """

    def __init__(self, labels: Mapping[int, str]) -> None:
        self._names = part_names(labels)
        self._labels = tuple(labels)
        self._surface: Surface | None = None
        self._charts: dict[str, Charts] = {}
        self._tile = 0.0
        self.meshes: dict[str, TriangleMesh] = {name: _NOTHING for name in self._names.values()}
        """The mesh of each part, by its name, in the frame of the tissue."""

    def show(self, surface: Surface) -> bool:
        """Take the surface as it now is; return whether it is another than before."""
        before, self._surface = self._surface, surface
        if before is None or not _same_triangles(before, surface):
            if before is None:
                size = np.linalg.norm(np.ptp(surface.rest_positions, axis=0))
                self._tile = float(size) / TILES_PER_BODY
            self._charts = {
                name: charts_of(surface.rest_positions, surface.triangles[chosen], self._tile)
                for name, chosen in self._chosen(surface)
            }
        elif np.array_equal(before.positions, surface.positions):
            return False
        for name, charts in self._charts.items():
            self.meshes[name] = charts.mesh(surface.positions)
        return True

    def _chosen(self, surface: Surface) -> Iterable[tuple[str, IntArray]]:
        """Yield the name of each part, and its triangles."""
        labels = surface.labels
        for key, name in self._names.items():
            chosen = surface.is_cut == key.is_cut
            if key.label is not None:
                chosen = chosen & (labels == key.label if labels is not None else False)
            yield name, np.flatnonzero(chosen)


def _same_triangles(one: Surface, other: Surface) -> bool:
    """Return whether two surfaces differ in nothing but positions."""
    same = len(one.positions) == len(other.positions) and np.array_equal(
        one.triangles, other.triangles
    )
    if not (same and np.array_equal(one.is_cut, other.is_cut)):
        return False
    if one.labels is None or other.labels is None:
        return one.labels is other.labels
    return np.array_equal(one.labels, other.labels)


_NOTHING = TriangleMesh(np.zeros((0, 3)), np.zeros((0, 3), np.int64), np.zeros((0, 3)))
