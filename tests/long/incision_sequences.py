"""Random sequences of incisions, and the pieces that the same cuts leave in exact geometry."""

from collections.abc import Iterator
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from tests import soundness
from tests.exact_pieces import ExactPieces, Parts, divided
from tests.long.cut_sequences import BODIES, Cut, Draw, body, drawn, kinds_of
from tissue import CutSettings, FloatArray, Snapshot, Tissue

PATH_ERROR = 0.3
"""How far a snapped cut may lie from where it was told to be [mean node sizes]: `CutSettings.snap`
and `floor`."""

LARGEST_CRUMB = 0.125
"""Volume of a crumb at most, as a share of the body (`CutSettings.crumb`)."""

LARGE = 700
"""Tetrahedra above which each is divided into 8 parts and not into 64."""


class Variant(NamedTuple):
    """The same cuts, but each with its rim or itself moved by the path error."""

    widened: float = 0.0
    """By how much each cut is larger all round [path errors]."""
    crumb: float = 1.0
    """Volume up to which a piece is a crumb, over that of the body. A crumb is as large as a few
    tetrahedra; the path error is about half of its volume."""
    aside: int = 0
    """Seed of the side to which each cut is moved; 0 where it stays."""


EXACT = Variant()
MOVED = (
    Variant(widened=1.0, crumb=0.5),
    Variant(widened=-1.0, crumb=2.0),
    Variant(aside=1),
    Variant(aside=2),
    Variant(widened=1.0, crumb=0.5, aside=3),
    Variant(widened=-1.0, crumb=2.0, aside=4),
)


@lru_cache
def parts_of(name: str) -> Parts:
    mesh = body(name)
    return divided(mesh, 1 if len(mesh.tetrahedra) > LARGE else 2)


def run(case: int) -> dict[str, Any]:
    """Make a sequence of incisions.

    Returns:
        `body`, its `faults`, `n_incisions`, `pieces`: how many are larger than a crumb; and
        `exact`: as many as the same cuts leave in exact geometry; and then as many as they leave
        where each is moved by the path error, up to the first variant that differs. Where the body
        has another number it is all variants.
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
    found = soundness.faults(before, after, mass=1e-9, lips_match=False)
    found += soundness.link_faults(tissue._body)
    crumb = min(CutSettings().crumb / len(mesh.tetrahedra), LARGEST_CRUMB) * volume_of(before)
    n = int((soundness.piece_volumes(after)[1] > crumb).sum())
    counts = exact_counts(parts_of(name), cuts, crumb, PATH_ERROR * tissue.node_size)
    exact = [next(counts)]
    for count in counts:
        exact.append(count)
        if count != exact[0] == n:
            break
    return {
        "body": name,
        "faults": found,
        "n_incisions": len(cuts),
        "pieces": n,
        "exact": exact,
    }


def volume_of(snapshot: Snapshot) -> float:
    return float(soundness.volumes(snapshot.rest_positions, snapshot.tetrahedra).sum())


def centre_of_smallest(snapshot: Snapshot) -> FloatArray | None:
    """Return the centre of the smallest piece at rest [m]; None where there is only one."""
    piece, volumes = soundness.piece_volumes(snapshot)
    if len(volumes) == 1:
        return None
    nodes = snapshot.tetrahedra[piece == np.argmin(volumes)]
    return snapshot.rest_positions[nodes].mean(axis=(0, 1))


def exact_counts(parts: Parts, cuts: list[Cut], crumb: float, error: float) -> Iterator[int]:
    """Yield the number of pieces after the cuts, and after those of each variant in turn."""
    for variant in (EXACT, *MOVED):
        pieces = ExactPieces(parts, variant.crumb * crumb)
        for cut in cuts:
            pieces.cut(moved(cut.surface, variant, error))
        yield int((pieces.volumes() > pieces.crumb).sum())


def moved(surface: FloatArray, variant: Variant, error: float) -> FloatArray:
    """Return the surface of a cut in a variant; the same cut is always moved in the same way.

    Args:
        surface: Edges [m], shape (n_positions, 2, 3).
        variant: How it is moved.
        error: The path error [m].
    """
    if len(surface) == 0:
        return surface
    side = 0
    if variant.aside:
        of_cut = int(1e9 * abs(surface[0]).sum())
        side = int(np.random.default_rng([variant.aside, of_cut]).choice([-1, 1]))
    sideways = np.cross(surface[-1, 0] - surface[0, 0], surface[0, 1] - surface[0, 0])
    sideways *= side * error / np.linalg.norm(sideways)
    edges = _longer(surface + sideways, variant.widened * error)
    return _longer(edges.swapaxes(0, 1), variant.widened * error).swapaxes(0, 1)


def _longer(rows: FloatArray, by: float) -> FloatArray:
    """Return the ends of each row of points moved outward [m], or inward to the middle at most.

    Args:
        rows: The rows run along the second axis, shape (n, m, 3).
        by: How far [m]; inward where negative.
    """
    longer = rows.copy()
    for end, next_to_it in ((0, 1), (-1, -2)):
        outward = rows[:, end] - rows[:, next_to_it]
        length = np.linalg.norm(outward, axis=1, keepdims=True)
        longer[:, end] += np.maximum(by, -0.49 * length) * outward / length
    return longer
