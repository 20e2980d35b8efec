"""Random sequences of incisions, and the pieces that the same cuts leave in exact geometry."""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from tests.long.cut_sequences import BODIES, Cut, Draw, body, drawn, kinds_of
from tests.support import soundness
from tests.support.exact_pieces import ExactPieces, Parts, divided
from tests.support.piece_bounds import centroids_of, contradictions, decided, pieces_at
from tissue import CutSettings, FloatArray, Snapshot, TetrahedralMesh, Tissue

PATH_ERROR = 0.6
"""How far a cut of a mesh may lie from where it was told to be [node sizes]. It snaps by up to 0.3
(`CutSettings.snap`, `floor`); where no thinner tetrahedron may be made (`guard`) it goes to a node
farther away, in bodies that are cut already most of all. With 0.3, five of the cases 0 to 39
contradict what is decided, with 0.6 none."""

LARGEST_CRUMB = 0.125
"""Volume of a crumb at most, as a share of the body (`CutSettings.crumb`)."""

LARGE = 700
"""Tetrahedra above which each is divided into 8 parts and not into 64."""


class Divided(NamedTuple):
    """A body in equal parts."""

    parts: Parts
    error: FloatArray
    """Path error at each part [m], shape (n_parts,)."""


@lru_cache
def divided_body(name: str) -> Divided:
    mesh = body(name)
    times = 1 if len(mesh.tetrahedra) > LARGE else 2
    sizes = node_sizes(mesh)
    largest = np.maximum(sizes[mesh.tetrahedra].max(axis=1), sizes.mean())
    return Divided(divided(mesh, times), np.repeat(PATH_ERROR * largest, 8**times))


def run(case: int) -> dict[str, Any]:
    """Make a sequence of incisions.

    Returns:
        `body`, its `faults`, `n_incisions`; `pieces`: how many are larger than a crumb; `exact`: as
        many as the same cuts leave in exact geometry; `contradictions` to what is decided there;
        and the share of the body that is, as `decided`.
    """
    random = np.random.default_rng([case, 1])
    name = str(random.choice(list(BODIES)))
    mesh = body(name)
    tissue = Tissue(mesh, gravity=(0.0, 0.0, 0.0))
    before = tissue.snapshot()
    cuts: list[Cut] = []
    for kind in kinds_of(random):
        cut = drawn(kind, Draw(random, mesh, cuts, centre_of_smallest(tissue.snapshot())))
        cuts.append(cut)
        tissue.incise(*cut.incision)
    after = tissue.snapshot()
    faults = soundness.faults(before, after, mass=1e-9, lips_match=False)
    faults += soundness.link_faults(tissue._body)
    crumb = min(CutSettings().crumb / len(mesh.tetrahedra), LARGEST_CRUMB) * volume_of(before)
    piece, volumes = soundness.piece_volumes(after)
    parts, error = divided_body(name)
    surfaces = [cut.surface for cut in cuts]
    found = decided(parts, surfaces, error)
    at = pieces_at(centroids_of(parts)[found.parts], after, piece)
    volume = parts.volumes[found.parts]
    return {
        "body": name,
        "faults": faults,
        "n_incisions": len(cuts),
        "pieces": int((volumes > crumb).sum()),
        "exact": exact_pieces(parts, surfaces, crumb),
        "contradictions": contradictions(found, at, volume, crumb),
        "decided": float(volume.sum() / parts.volumes.sum()),
    }


def node_sizes(mesh: TetrahedralMesh) -> FloatArray:
    """Return the least altitude of the tetrahedra around each node [m], shape (n_nodes,)."""
    x, tetrahedra = mesh.positions, mesh.tetrahedra
    opposite = [np.delete(tetrahedra, corner, axis=1) for corner in range(4)]
    largest = np.max([soundness.triangle_areas(x, face) for face in opposite], axis=0)
    altitudes = 3.0 * np.abs(soundness.volumes(x, tetrahedra)) / largest
    sizes = np.full(len(x), np.inf)
    np.minimum.at(sizes, tetrahedra, altitudes[:, None])
    return sizes


def volume_of(snapshot: Snapshot) -> float:
    return float(soundness.volumes(snapshot.rest_positions, snapshot.tetrahedra).sum())


def centre_of_smallest(snapshot: Snapshot) -> FloatArray | None:
    """Return the centre of the smallest piece at rest [m]; None where there is only one."""
    piece, volumes = soundness.piece_volumes(snapshot)
    if len(volumes) == 1:
        return None
    nodes = snapshot.tetrahedra[piece == np.argmin(volumes)]
    return snapshot.rest_positions[nodes].mean(axis=(0, 1))


def exact_pieces(parts: Parts, surfaces: list[FloatArray], crumb: float) -> int:
    """Return how many pieces larger than a crumb [m3] the cuts leave where nothing snaps."""
    pieces = ExactPieces(parts, crumb)
    for surface in surfaces:
        pieces.cut(surface)
    return int((pieces.volumes() > crumb).sum())
