"""Bad tetrahedra are mended where they are: by collapse, other connections, and small moves.

The operations are those of Klingner and Shewchuk, "Aggressive tetrahedral mesh improvement" (2007),
without the insertion of nodes: an edge is collapsed or removed, a face is flipped, a node moves, a
sliver on the skin is peeled off. One is done where the worst tetrahedron of those that it changes
gets better. Labels stay: nodes and edges between two labels count as skin.
"""

import itertools
from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from tissue import FloatArray

if TYPE_CHECKING:
    from tissue import TetrahedralMesh

LARGEST_REPAIRED_RING = 8
"""Tetrahedra around an edge that is removed at most: of more nothing good is made."""

MOST_REPAIR_PASSES = 12
"""Passes through the bad tetrahedra; the last ones hardly mend any."""

LEAST_GAIN = 1e-4
"""Quality by which the worst tetrahedron must get better, so that passes come to an end."""

FIRST_MOVE = 0.3
"""First step of a node that is moved, per mean edge around it."""

MOVE_HALVINGS = 5
"""Halvings of that step."""

MOVE_DIRECTIONS = np.array(
    [d for d in itertools.product((-1, 0, 1), repeat=3) if any(d)], dtype=float
)
"""In which a node is moved."""

NodesOfTet = tuple[int, int, int, int]


class LocalRepair(NamedTuple):
    """A mesh that was mended in places."""

    mesh: "TetrahedralMesh"
    counts: dict[str, int]
    """Number of operations of each kind."""
    bound: float
    """Farthest that the surface moved, at most [m]."""


def mended(mesh: "TetrahedralMesh", target: float, step: float) -> LocalRepair:
    """Return a mesh whose tetrahedra have the quality `target`, as far as that is possible.

    Args:
        mesh: The mesh; of positive and negative volumes, without nodes in the same place.
        target: Smallest quality that is wanted.
        step: Farthest that one operation may move the surface [m]. Where several meet it moves by
            three times as much at most.
    """
    patchwork = _Patchwork(mesh, step)
    patchwork.improve(target)
    return LocalRepair(patchwork.mesh(mesh), patchwork.counts, patchwork.farthest)


class _Patchwork:
    """Tetrahedra that are taken out and put in one by one."""

    def __init__(self, mesh: "TetrahedralMesh", step: float) -> None:
        self._positions = mesh.positions.copy()
        self._origin = mesh.positions
        self._step = step
        self._tets: list[NodesOfTet | None] = [tuple(t) for t in mesh.tetrahedra.tolist()]
        labels = np.zeros(len(self._tets), int) if mesh.labels is None else mesh.labels
        self._labels: list[int] = labels.tolist()
        self._around: list[set[int]] = [set() for _ in range(len(mesh.positions))]
        for t, tet in enumerate(mesh.tetrahedra.tolist()):
            for node in tet:
                self._around[node].add(t)
        self._clock = 0
        self._touched = [0] * len(mesh.positions)  # when something around a node changed
        self.counts = {"collapsed edges": 0, "changed connections": 0, "moved nodes": 0}
        self.counts["peeled slivers"] = 0
        self.farthest = 0.0

    def mesh(self, before: "TetrahedralMesh") -> "TetrahedralMesh":
        """Return the mesh as it is now, without nodes that are not used."""
        kept = [t for t, tet in enumerate(self._tets) if tet is not None]
        tets = np.array([self._tets[t] for t in kept], dtype=np.int64)
        used, tets = np.unique(tets, return_inverse=True)
        labels = None if before.labels is None else np.array([self._labels[t] for t in kept])
        return before._replace(
            positions=self._positions[used], tetrahedra=tets.reshape(-1, 4), labels=labels
        )

    def improve(self, target: float) -> None:
        """Mend tetrahedra below a quality, the worst first, until none gets better."""
        operations: tuple[tuple[str, Callable[[NodesOfTet], bool]], ...] = (
            ("collapsed edges", self._collapse),
            ("changed connections", self._reconnect),
            ("peeled slivers", self._peel),
            ("moved nodes", self._move),
        )
        tried: dict[int, int] = {}
        for _ in range(MOST_REPAIR_PASSES):
            alive = [t for t, tet in enumerate(self._tets) if tet is not None]
            shape = self._quality([self._tets[t] for t in alive])
            order = np.argsort(shape, kind="stable")[: int((shape < target).sum())]
            has_changed = False
            for t in (alive[i] for i in order):
                tet = self._tets[t]
                if tet is None or self._quality([tet])[0] >= target:
                    continue
                if tried.get(t, -1) >= max(self._touched[node] for node in tet):
                    continue  # nothing around it has changed
                tried[t] = self._clock
                for name, operation in operations:
                    if operation(tet):
                        self.counts[name] += 1
                        has_changed = True
                        break
            if not has_changed:
                return

    def _quality(self, tets: Sequence[NodesOfTet | None]) -> FloatArray:
        """Return the quality of tetrahedra."""
        from tissue.support import quality

        return quality(self._positions, np.array(tets, dtype=np.int64).reshape(-1, 4))

    def _worst(self, tets: Sequence[NodesOfTet | None]) -> float:
        """Return the smallest quality; infinity of none."""
        return float(self._quality(tets).min(initial=np.inf))

    def _may_replace(self, old: Sequence[int], new: Sequence[NodesOfTet]) -> bool:
        """Return whether each face would belong to two tetrahedra at most, and the worst be better.

        Where a mesh is folded an operation may come upon tetrahedra that are there already.
        """
        if self._worst(new) < self._worst([self._tets[t] for t in old]) + LEAST_GAIN:
            return False
        counts: dict[tuple[int, ...], int] = {}
        for tet in new:
            for face in itertools.combinations(sorted(tet), 3):
                counts[face] = counts.get(face, 0) + 1
        return all(n + len(set(self._sharing(*face)) - set(old)) <= 2 for face, n in counts.items())

    def _replace(
        self, old: Sequence[int], new: Sequence[NodesOfTet], labels: Sequence[int]
    ) -> None:
        """Put tetrahedra in the place of others."""
        self._touch([node for t in old for node in self._tets[t] or ()])
        for t in old:
            for node in self._tets[t] or ():
                self._around[node].discard(t)
            self._tets[t] = None
        for tet, label in zip(new, labels, strict=True):
            for node in tet:
                self._around[node].add(len(self._tets))
            self._tets.append(tet)
            self._labels.append(label)

    def _touch(self, nodes: Iterable[int]) -> None:
        """Note that something around nodes has changed."""
        self._clock += 1
        for node in nodes:
            self._touched[node] = self._clock

    def _sharing(self, *nodes: int) -> list[int]:
        """Return the tetrahedra that have all these nodes, in the order of their numbers."""
        return sorted(set.intersection(*(self._around[n] for n in nodes)))

    def _is_skin_face(self, face: Sequence[int]) -> bool:
        """Return whether a face is on the boundary, or between two labels."""
        owners = self._sharing(*face)
        return len(owners) != 2 or self._labels[owners[0]] != self._labels[owners[1]]

    def _on_skin(self, *nodes: int) -> bool:
        """Return whether a node or an edge is in a face of the skin."""
        for t in self._sharing(*nodes):
            rest = [n for n in self._tets[t] or () if n not in nodes]
            for others in itertools.combinations(rest, 3 - len(nodes)):
                if self._is_skin_face((*nodes, *others)):
                    return True
        return False

    def _sides(self, node: int) -> set[int]:
        """Return the labels around a node; -1: the outside."""
        sides = {self._labels[t] for t in self._around[node]}
        for t in self._around[node]:
            rest = [n for n in self._tets[t] or () if n != node]
            if any(len(self._sharing(node, *two)) == 1 for two in itertools.combinations(rest, 2)):
                return sides | {-1}
        return sides

    def _collapse(self, tet: NodesOfTet) -> bool:
        """Move a node of a tetrahedron onto another one of it."""
        pairs = sorted(
            itertools.permutations(tet, 2),
            key=lambda p: float(np.linalg.norm(self._positions[p[0]] - self._positions[p[1]])),
        )
        return any(self._collapse_edge(u, v) for u, v in pairs)

    def _collapse_edge(self, u: int, v: int) -> bool:
        """Move node u onto node v where that makes things better."""
        way = float(np.linalg.norm(self._positions[u] - self._positions[v]))
        is_skin = self._on_skin(u)
        if is_skin and (way > self._step or not self._on_skin(u, v)):
            return False
        shared, own = self._sharing(u, v), sorted(self._around[u])
        ring = {n for t in shared for n in self._tets[t] or ()} - {u, v}
        near = [{n for t in self._around[x] for n in self._tets[t] or ()} for x in (u, v)]
        if (near[0] & near[1]) - {u, v} != ring or not self._sides(u) <= self._sides(v):
            return False
        kept = [t for t in own if t not in shared]
        new = [_with(self._tets[t], u, v) for t in kept]
        if not self._may_replace(own, new):
            return False
        self._replace(own, new, [self._labels[t] for t in kept])
        if is_skin:
            self.farthest = max(self.farthest, way)
        return True

    def _reconnect(self, tet: NodesOfTet) -> bool:
        """Remove an edge of a tetrahedron, or flip one of its faces."""
        return any(self._remove_edge(a, b) for a, b in itertools.combinations(tet, 2)) or any(
            self._flip_face(face) for face in itertools.combinations(tet, 3)
        )

    def _remove_edge(self, a: int, b: int) -> bool:
        """Connect the ring around an edge within itself, where that makes things better."""
        old = self._sharing(a, b)
        after: dict[int, int] = {}
        for t in old:
            c, d = _behind(self._tets[t], a, b)
            after[c] = d
        ring = [next(iter(after))]
        while after.get(ring[-1], ring[0]) != ring[0] and len(ring) < len(old):
            ring.append(after[ring[-1]])
        m = len(ring)
        if m != len(old) or m > LARGEST_REPAIRED_RING or m < 3 or after.get(ring[-1]) != ring[0]:
            return False
        if len({self._labels[t] for t in old}) > 1:
            return False
        triples = list(itertools.combinations(range(m), 3))
        pairs = [_on_both_sides([ring[i] for i in triple], a, b) for triple in triples]
        shape = self._quality([tet for pair in pairs for tet in pair]).reshape(-1, 2).min(axis=1)
        worst, chosen = _best_triangulation(m, dict(zip(triples, shape.tolist(), strict=True)))
        if worst < self._worst([self._tets[t] for t in old]) + LEAST_GAIN:
            return False
        new = [tet for k, triple in enumerate(triples) if triple in chosen for tet in pairs[k]]
        if not self._may_replace(old, new):
            return False
        self._replace(old, new, [self._labels[old[0]]] * len(new))
        return True

    def _flip_face(self, face: tuple[int, ...]) -> bool:
        """Make three tetrahedra of the two at a face, where that makes things better."""
        old = self._sharing(*face)
        if len(old) != 2 or self._labels[old[0]] != self._labels[old[1]]:
            return False
        (d,), (e,) = (set(self._tets[t] or ()) - set(face) for t in old)
        if d == e or self._sharing(d, e):
            return False
        p, q, r = face
        if not _is_even(self._tets[old[0]], (p, q, r, d)):
            q, r = r, q
        new: list[NodesOfTet] = [(e, d, p, q), (e, d, q, r), (e, d, r, p)]
        if not self._may_replace(old, new):
            return False
        self._replace(old, new, [self._labels[old[0]]] * 3)
        return True

    def _peel(self, tet: NodesOfTet) -> bool:
        """Take a sliver off the boundary, which has two or three faces there."""
        (t,) = self._sharing(*tet)[:1]
        outer = [f for f in itertools.combinations(tet, 3) if len(self._sharing(*f)) == 1]
        if len(outer) != 2:
            return False
        a, b = set(outer[0]) & set(outer[1])
        c, d = set(tet) - {a, b}
        at = self._positions
        normal = np.cross(at[b] - at[a], at[d] - at[c])
        length = float(np.linalg.norm(normal))
        way = abs(float(normal @ (at[c] - at[a]))) / length if length > 0.0 else np.inf
        others = [n for x in (c, d) for n in self._sharing(x) if n != t]
        if way > self._step or not others or self._on_boundary_edge(c, d):
            return False
        self._replace([t], [], [])
        self.farthest = max(self.farthest, way)
        return True

    def _on_boundary_edge(self, a: int, b: int) -> bool:
        """Return whether an edge is on the boundary."""
        for t in self._sharing(a, b):
            for other in set(self._tets[t] or ()) - {a, b}:
                if len(self._sharing(a, b, other)) == 1:
                    return True
        return False

    def _move(self, tet: NodesOfTet) -> bool:
        """Move a node of a tetrahedron to a better place."""
        return any(self._move_node(node) for node in tet)

    def _move_node(self, node: int) -> bool:
        """Move a node to where the worst tetrahedron around it is best, by ever smaller steps."""
        from tissue.support import quality

        star = np.array([self._tets[t] for t in sorted(self._around[node])], dtype=np.int64)
        start = self._positions[node].copy()
        spokes = self._positions[star].reshape(-1, 3) - start
        step = FIRST_MOVE * float(np.linalg.norm(spokes, axis=1).sum()) / (3 * len(star))
        is_skin = self._on_skin(node)
        reach = self._step if is_skin else np.inf
        before = best = float(quality(self._positions, star).min())
        place = start
        for _ in range(MOVE_HALVINGS):
            for way in MOVE_DIRECTIONS:
                tried = place + step * way
                if np.linalg.norm(tried - self._origin[node]) > reach:
                    continue
                self._positions[node] = tried
                shape = float(quality(self._positions, star).min())
                if shape > best:
                    best, place = shape, tried
            step *= 0.5
        is_better = best >= before + LEAST_GAIN
        self._positions[node] = place if is_better else start
        if is_better:
            self._touch(star.ravel().tolist())
        if is_better and is_skin:
            way = float(np.linalg.norm(place - self._origin[node]))
            self.farthest = max(self.farthest, way)
        return is_better


def _with(tet: NodesOfTet | None, old: int, new: int) -> NodesOfTet:
    """Return a tetrahedron with a node in the place of another."""
    a, b, c, d = (new if n == old else n for n in tet or ())
    return a, b, c, d


def _is_even(tet: NodesOfTet | None, order: Sequence[int]) -> bool:
    """Return whether an order of the nodes of a tetrahedron has the same orientation."""
    place = [(tet or ()).index(n) for n in order]
    return sum(p > q for p, q in itertools.combinations(place, 2)) % 2 == 0


def _behind(tet: NodesOfTet | None, a: int, b: int) -> tuple[int, int]:
    """Return the other two nodes of a tetrahedron, such that a, b, c, d is as it is."""
    c, d = (n for n in tet or () if n not in (a, b))
    return (c, d) if _is_even(tet, (a, b, c, d)) else (d, c)


def _on_both_sides(triangle: Sequence[int], a: int, b: int) -> list[NodesOfTet]:
    """Return the tetrahedra between a triangle of a ring and the ends of the edge in it."""
    c, d, e = triangle
    return [(c, d, e, b), (c, e, d, a)]


def _best_triangulation(
    m: int, shape: dict[tuple[int, int, int], float]
) -> tuple[float, set[tuple[int, int, int]]]:
    """Return the triangles that divide a ring of m nodes so that the worst is best (Klincsek)."""
    best: dict[tuple[int, int], tuple[float, set[tuple[int, int, int]]]] = {}
    for i in range(m - 1):
        best[i, i + 1] = (np.inf, set())
    for width in range(2, m):
        for i in range(m - width):
            k = i + width
            choices = []
            for j in range(i + 1, k):
                (left, a), (right, b) = best[i, j], best[j, k]
                worst = min(left, right, shape[i, j, k])
                choices.append((worst, a | b | {(i, j, k)}))
            best[i, k] = max(choices, key=lambda choice: choice[0])
    return best[0, m - 1]
