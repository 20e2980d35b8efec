"""Material points: places in the body at rest, which move with the tissue and survive cuts."""

import numpy as np
import numpy.typing as npt

from tissue.boundary_conditions import fixed_nodes
from tissue.core.array_types import BoolArray, FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.vec3 import vec3
from tissue.geometry.tetrahedron import barycentric_in, smallest_weight
from tissue.mesh.body import INSIDE_TOLERANCE, OUTER, Body
from tissue.types import TetrahedralMesh

FARTHEST_OUTSIDE = 1e-6
"""Barycentric weight below zero at which a given point is refused: rounding of a file's digits."""


class MaterialPoints:
    """Points of the material: each in a tetrahedron, with its barycentric weights.

    Args:
        rest: Where they are in the body at rest [m], shape (n, 3).
        tetrahedra: A tetrahedron of each, or -1 where it is not known; shape (n,).
        shares: Share of each in what acts on all together, shape (n,); they add up to 1.
    """

    def __init__(self, rest: FloatArray, tetrahedra: IntArray, shares: FloatArray) -> None:
        self.rest = rest
        self.shares = shares
        self._tetrahedra = tetrahedra
        self._weights = np.zeros((len(rest), 4))

    def __len__(self) -> int:
        return len(self.rest)

    @property
    def last_holders(self) -> IntArray:
        """The tetrahedron that held each point when it was looked up last, shape (n,)."""
        return self._tetrahedra

    def holders(self, body: Body) -> IntArray:
        """Return the tetrahedron that holds each point now, shape (n,)."""
        # Cuts split tetrahedra and move nodes at rest: the points stay where they are.
        locate_points(body, self.rest, self._tetrahedra, self._weights)
        return self._tetrahedra

    def nodes_and_weights(self, body: Body) -> tuple[IntArray, FloatArray]:
        """Return the nodes around each point and their barycentric weights, shapes (n, 4)."""
        return body.tetrahedra[self.holders(body)], self._weights

    def repeated(self, n: int) -> "MaterialPoints":
        """Return these points; one point as often as that.

        Raises:
            ValueError: there are more than one, and not `n`.
        """
        if len(self) == n:
            return self
        if len(self) != 1:
            raise ValueError(
                f"there are {len(self)} other ends for {n} points; give one, or one for each"
            )
        rest, tetrahedra = np.repeat(self.rest, n, axis=0), np.repeat(self._tetrahedra, n)
        return MaterialPoints(rest, tetrahedra, np.full(n, 1.0 / n))

    def positions(self, body: Body) -> FloatArray:
        """Return where the points are now [m], shape (n, 3)."""
        nodes, weights = self.nodes_and_weights(body)
        return np.asarray(np.einsum("nk,nkx->nx", weights, body.positions[nodes]))


@kernel
def locate_points(body: Body, rest: FloatArray, tetrahedra: IntArray, weights: FloatArray) -> None:
    """Find the tetrahedron that holds each point of the body at rest.

    Args:
        body: The body.
        rest: The points [m], shape (n, 3).
        tetrahedra: Where each was last, or -1; written.
        weights: Barycentric weights of the points, shape (n, 4); written. Outside the body they are
            those in the tetrahedron that the point is least outside of.
    """
    for k in range(len(tetrahedra)):
        p, held = vec3(rest, k), tetrahedra[k]
        if held >= 0:
            w = barycentric_in(p, body.rest, body.tetrahedra, held)
            if smallest_weight(w) >= -INSIDE_TOLERANCE:
                for i in range(4):
                    weights[k, i] = w[i]
                continue
        deepest = -np.inf
        # What a cut makes of a tetrahedron keeps its label, and bodies touch at rest.
        label = body.materials.label[body.material[held]] if held >= 0 else -1
        for t in range(body.n_tetrahedra):
            if label >= 0 and body.materials.label[body.material[t]] != label:
                continue
            depth = _depth(body, rest, k, t)
            if depth > deepest:
                deepest, held = depth, t
            if depth > INSIDE_TOLERANCE:  # and so in no other
                break
        tetrahedra[k] = held
        w = barycentric_in(p, body.rest, body.tetrahedra, held)
        for i in range(4):
            weights[k, i] = w[i]


@kernel
def _depth(body: Body, rest: FloatArray, k: int, t: int) -> float:
    """Return the smallest barycentric weight of point `k` in tetrahedron `t`."""
    return smallest_weight(barycentric_in(vec3(rest, k), body.rest, body.tetrahedra, t))


def region_mask(body: Body, region: str | BoolArray) -> BoolArray:
    """Return the mask of the nodes of a region, shape (n_nodes,).

    Raises:
        ValueError: the text names no region, or the mask has another shape.
    """
    n = body.n_nodes
    if isinstance(region, str):
        labels = body.materials.label[body.material[: body.n_tetrahedra]]
        mesh = TetrahedralMesh(body.rest[:n], body.tetrahedra[: body.n_tetrahedra], labels)
        return fixed_nodes(mesh, region)
    if region.shape != (n,):
        raise ValueError(
            f"the mask of a region has shape {region.shape}; it is one truth value for each of the "
            f"{n} nodes"
        )
    return region


def points_of(body: Body, where: str | npt.ArrayLike) -> MaterialPoints:
    """Return material points of a body; see `tissue.Tissue.push` for what `where` may be.

    Raises:
        ValueError: no point is there, or one is outside the body.
    """
    if isinstance(where, str):
        return _skin_points(body, region_mask(body, where), f"'{where}'")
    array = np.asarray(where)
    if array.dtype == np.bool_:
        return _skin_points(body, region_mask(body, array), "the mask")
    if array.dtype.kind in "iu":
        return _node_points(body, np.atleast_1d(array).astype(np.int64))
    return _rest_points(body, np.atleast_2d(array.astype(np.float64)))


def points_to_hold(body: Body, where: str | npt.ArrayLike | MaterialPoints) -> MaterialPoints:
    """Return the points by which an attachment holds: of a region its nodes, else `points_of`.

    Raises:
        ValueError: no point is there, or one is outside the body.
    """
    if isinstance(where, MaterialPoints):
        return where
    region = np.asarray(where)
    if not isinstance(where, str) and region.dtype != np.bool_:
        return points_of(body, where)
    mask = region_mask(body, where if isinstance(where, str) else region)
    if not mask.any():
        raise ValueError(f"no node is in the region {where!r}; take a larger one, or give points")
    return points_of(body, np.flatnonzero(mask))


def _skin_points(body: Body, mask: BoolArray, name: str) -> MaterialPoints:
    """Return the centroids of the faces of the skin in a region, each with its share of area."""
    tetrahedra = body.tetrahedra[: body.n_tetrahedra]
    t, face = np.nonzero(body.links[: body.n_tetrahedra] == OUTER)
    others = np.array([[k for k in range(4) if k != f] for f in range(4)])
    nodes = tetrahedra[t[:, None], others[face]]
    inside = mask[nodes].all(axis=1)
    if not inside.any():
        raise ValueError(
            f"no face of the skin has all its nodes in the region {name}; take a larger region, or "
            "give nodes or points"
        )
    a, b, c = (body.rest[nodes[inside, k]] for k in range(3))
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return MaterialPoints((a + b + c) / 3.0, t[inside], area / area.sum())


def _node_points(body: Body, nodes: IntArray) -> MaterialPoints:
    """Return material points at nodes, with equal shares."""
    wrong = nodes[(nodes < 0) | (nodes >= body.n_nodes)]
    if wrong.size or nodes.ndim != 1 or not nodes.size:
        what = f"there is no node {wrong.flat[0]}" if wrong.size else "the list of nodes is empty"
        raise ValueError(f"{what}; the body has the nodes 0 to {body.n_nodes - 1}")
    shares = np.full(len(nodes), 1.0 / len(nodes))
    return MaterialPoints(body.rest[nodes].copy(), body.node_tetrahedron[nodes], shares)


def _rest_points(body: Body, rest: FloatArray) -> MaterialPoints:
    """Return material points at places of the body at rest [m], with equal shares."""
    if rest.ndim != 2 or rest.shape[1] != 3 or not len(rest) or not np.isfinite(rest).all():
        raise ValueError(
            f"points have shape {rest.shape}; they are places in the body at rest in m, (n, 3), "
            "all finite"
        )
    shares = np.full(len(rest), 1.0 / len(rest))
    points = MaterialPoints(rest, np.full(len(rest), -1, dtype=np.int64), shares)
    _, weights = points.nodes_and_weights(body)
    outside = np.flatnonzero(weights.min(axis=1) < -FARTHEST_OUTSIDE)
    if outside.size:
        at = body.rest[: body.n_nodes]
        raise ValueError(
            f"the point {rest[outside[0]].tolist()} m is outside the body at rest, which goes from "
            f"{at.min(axis=0).tolist()} to {at.max(axis=0).tolist()} m"
        )
    return points
