"""A hundred thousand random stellar splits: volumes stay positive and add up."""

import numpy as np
import pytest

from tests.support import bodies
from tests.tissue.kernels_of import cut_of
from tissue import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import Vec3
from tissue.cutting.stellar_subdivision import split_edge, split_face
from tissue.cutting.workspace import Cut
from tissue.geometry.tetrahedron import tetrahedron_volume
from tissue.mesh.changes import clear_changes
from tissue.mesh.star import edge_star

N_BODIES = 200
N_SPLITS = 500
"""Splits of each body; with more, its tetrahedra become so small that rounding matters."""


@kernel
def volume_around(cut: Cut, a: int, b: int, out: IntArray) -> tuple[float, float]:
    """Return the sum and the smallest of the volumes around edge ab."""
    n = edge_star(cut.body, cut.visits, a, b, out)
    total, least = 0.0, np.inf
    for i in range(n):
        v = tetrahedron_volume(cut.body.rest, cut.body.tetrahedra, out[i])
        total += v
        least = min(least, v)
    return total, least


@kernel
def split_at_random(cut: Cut, which: FloatArray, before: FloatArray, after: FloatArray) -> float:
    """Split an edge or a face for each row of random numbers; return the smallest volume.

    Args:
        cut: The body to split.
        which: Numbers from 0 to 1 that choose the tetrahedron, nodes, place and kind, shape (n, 4).
        before: Written: volumes of the split tetrahedra before each split, shape (n,).
        after: Written: volumes of their children, shape (n,).
    """
    body = cut.body
    least = np.inf
    for i in range(len(which)):
        clear_changes(cut.change)
        t = int(which[i, 0] * body.n_tetrahedra)
        k = int(which[i, 1] * 4)
        a = body.tetrahedra[t, k]
        b = body.tetrahedra[t, (k + 1) % 4]
        c = body.tetrahedra[t, (k + 2) % 4]
        s = 0.2 + 0.6 * which[i, 2]
        before[i], _ = volume_around(cut, a, b, cut.scratch.around)
        if which[i, 3] < 0.5:
            node = split_edge(cut, a, b, s)
            first, least_a = volume_around(cut, a, node, cut.scratch.around)
            second, least_b = volume_around(cut, node, b, cut.scratch.around)
            after[i] = first + second
            least = min(least, min(least_a, least_b))
        else:  # after a face split the tetrahedra around edge ab are around it or around c
            face_before = 0.0
            n = edge_star(body, cut.visits, a, b, cut.scratch.around)
            for j in range(n):
                tetrahedron = cut.scratch.around[j]
                for m in range(4):
                    if body.tetrahedra[tetrahedron, m] == c:
                        face_before += tetrahedron_volume(body.rest, body.tetrahedra, tetrahedron)
            w = 0.5 * s
            node = split_face(cut, a, b, c, Vec3(w, 0.5 - 0.5 * w, 0.5 - 0.5 * w))
            total = 0.0
            for end in (a, b, c):
                v, smallest = volume_around(cut, node, end, cut.scratch.around)
                total += v
                least = min(least, smallest)
            before[i] = face_before
            after[i] = 0.5 * total  # each child holds two of the three ends
    return least


@pytest.mark.kernel
def test_10_volumes_are_positive_and_sum_to_those_of_the_star_in_1e5_splits():
    n_bodies = N_BODIES if hasattr(split_at_random, "signatures") else 1  # with the JIT off
    random = np.random.default_rng(10)
    for seed in range(n_bodies):
        cut = cut_of(bodies.jittered_grid(4, seed, size=1.0))
        before, after = np.empty(N_SPLITS), np.empty(N_SPLITS)
        assert split_at_random(cut, random.random((N_SPLITS, 4)), before, after) > 0.0
        np.testing.assert_allclose(after, before, rtol=1e-12)  # of stars with volumes down to 1e-6
        assert after.sum() == pytest.approx(before.sum(), rel=1e-14)
