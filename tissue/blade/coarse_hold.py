"""Passage of an anchor from a tetrahedron to the parts that a cut divides it into.

A force at a point moves a fine mesh further than a coarse one. If the nodes that a cut inserts at
the edge bore the pull of the anchors at once, the tissue there would jump ahead: the force dropped
by up to 35 %, and damping took 7 % of the work. So the tetrahedron continues to hold the anchor
through the nodes that it had, as if it were whole, until the anchor has slipped out of it.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.structs import Arrays
from tissue.core.vec3 import Vec3
from tissue.geometry.tetrahedron import Weights, barycentric_in, smallest_weight
from tissue.mesh.body import Body

OVERHANG = 0.5
"""Distance of the anchor from the tetrahedron where it is held by the new mesh alone, as a share
of the tetrahedron's altitude there. At 0.01, 0.25, 0.5 and 1 the force of steady cuts (60 J/m2,
30 kPa) falls to 0.88, 0.92, 0.94 and 0.96 of its mean at the lowest, and the mean is 1.01, 1.00,
0.985 and 0.97 of toughness times depth: far out the field of the tetrahedron is not that of the
tissue."""


class CoarseHold(Arrays):
    """For each anchor the tetrahedron that held it before the mesh was refined there."""

    nodes: IntArray
    """Nodes of the tetrahedron, shape (n, 4)."""
    weights: FloatArray
    """Barycentric weights of the anchor in it, at rest, shape (n, 4). Outside it some are
    negative."""
    share: FloatArray
    """Share of the anchor that it holds, from 1 to 0; shape (n,)."""


def new_coarse_hold(n: int) -> CoarseHold:
    """Return a hold of none of `n` anchors."""
    return CoarseHold(nodes=np.zeros((n, 4), np.int64), weights=np.zeros((n, 4)), share=np.zeros(n))


@inlined
def weights_of(weights: FloatArray, k: int) -> Weights:
    """Return row `k` of an array of weights."""
    return Weights(weights[k, 0], weights[k, 1], weights[k, 2], weights[k, 3])


@kernel
def store_weights(weights: FloatArray, k: int, w: Weights) -> None:
    """Write row `k` of an array of weights."""
    weights[k, 0] = w.a
    weights[k, 1] = w.b
    weights[k, 2] = w.c
    weights[k, 3] = w.d


@kernel
def begin_coarse_hold(coarse: CoarseHold, k: int, nodes: IntArray, weights: FloatArray) -> None:
    """Begin with the tetrahedron that held anchor `k` until now as its whole hold.

    Where an earlier one still holds more than half of the anchor, that one stays.

    Args:
        coarse: Written.
        k: The anchor.
        nodes: Nodes of the tetrahedron in row `k`, shape (n, 4).
        weights: Weights of the anchor in it in row `k`, shape (n, 4).
    """
    if coarse.share[k] > 0.5:
        return
    for q in range(4):
        coarse.nodes[k, q] = nodes[k, q]
        coarse.weights[k, q] = weights[k, q]
    coarse.share[k] = 1.0


@kernel
def move_coarse_hold(coarse: CoarseHold, body: Body, k: int, p: Vec3) -> None:
    """Write the weights of anchor `k` where it is now at rest, at `p` [m]."""
    if coarse.share[k] == 0.0:
        return
    w = barycentric_in(p, body.rest, coarse.nodes, k)
    if smallest_weight(w) > -OVERHANG:
        store_weights(coarse.weights, k, w)
    else:  # too far away, or the nodes have been moved into one plane
        coarse.share[k] = 0.0


@kernel
def fade_coarse_hold(coarse: CoarseHold, k: int) -> None:
    """Reduce the share of anchor `k` to what is due where it is now."""
    outside = -smallest_weight(weights_of(coarse.weights, k)) / OVERHANG
    coarse.share[k] = min(coarse.share[k], 1.0 - outside)
