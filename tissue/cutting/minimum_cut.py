"""The minimum cut between the two lips of an incision: the least area of faces that joins them.

The tetrahedra are the nodes of a graph, and the faces that two of them share are its edges, each
with its area as capacity. The tetrahedra of one lip are the sources, those of the other the sinks.
The largest flow from lip to lip is the least area of faces that parts them (Ford and Fulkerson
1956). It is found by Dinic's method: a breadth-first search levels the graph, a depth-first search
fills shortest paths until none is left, and so on.
"""

import numpy as np

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.sized import sized
from tissue.core.structs import Arrays, IntCell
from tissue.geometry.tetrahedron import face_area
from tissue.mesh.body import Body
from tissue.mesh.star import Visits

ROUNDED_AREA = 1e-9
"""Share of a face's area below which what is left of its capacity is rounding."""

OF_CORE = 1e6
"""Capacity of a face within a rigid core over its area: more than any cut that is made."""


class FlowGraph(Arrays):
    """The flow between two lips. Without terminals all entries are 0 and nothing is stored."""

    lip: IntArray = sized("tetrahedra")
    """Lip that each tetrahedron is of, +1 or -1, 0 for none; shape (tetrahedron capacity,)."""
    terminals: IntArray = sized("tetrahedra")
    """The tetrahedra that were put on a lip, shape (tetrahedron capacity,)."""
    n_terminals: IntCell
    """Number of entries in `terminals`."""
    flow: FloatArray = sized("tetrahedra", 4)
    """Flow out of each tetrahedron through each face [m2], shape (tetrahedron capacity, 4)."""
    has_flow: IntArray = sized("tetrahedra")
    """Whether a tetrahedron is in `carriers`, shape (tetrahedron capacity,)."""
    carriers: IntArray = sized("tetrahedra")
    """The tetrahedra that flow was sent through, shape (tetrahedron capacity,)."""
    n_carriers: IntCell
    """Number of entries in `carriers`."""
    level: IntArray = sized("tetrahedra")
    """Faces between the lip +1 and each tetrahedron, where visited; (tetrahedron capacity,)."""
    next_face: IntArray = sized("tetrahedra")
    """Face of each tetrahedron to try next, where visited; shape (tetrahedron capacity,)."""
    queue: IntArray = sized("tetrahedra")
    """Tetrahedra in the order in which they were visited, shape (tetrahedron capacity,)."""
    n_queued: IntCell
    """Number of entries in `queue`: in the end the side of the minimum cut that lip +1 is on."""
    stack: IntArray = sized("tetrahedra")
    """Faces that a path goes through, as 4 * tetrahedron + face; (tetrahedron capacity,)."""


def new_flow_graph(n_tetrahedra: int) -> FlowGraph:
    """Return a graph without lips, for a body with room for that many tetrahedra."""
    return FlowGraph.new({"tetrahedra": n_tetrahedra})


@kernel
def put_on_lip(graph: FlowGraph, t: int, side: int) -> None:
    """Make tetrahedron `t` part of a lip, +1 or -1, unless it is part of one."""
    if graph.lip[t] == 0:
        graph.lip[t] = side
        graph.terminals[graph.n_terminals] = t
        graph.n_terminals += 1


@kernel
def clear_lips(graph: FlowGraph) -> None:
    """Forget the lips."""
    for i in range(graph.n_terminals):
        graph.lip[graph.terminals[i]] = 0
    graph.n_terminals = 0


@kernel
def minimum_cut(graph: FlowGraph, body: Body, visits: Visits, limit: float) -> float:
    """Return the least area of faces that parts the lips [m2], or an area above `limit`.

    The side of lip +1 is then in `graph.queue`, and stamped in `visits` with the current epoch;
    unless the area is above the limit, where the search ends as soon as it is known to be.

    Args:
        graph: With the lips; the flow is written.
        body: The tissue.
        visits: For the search.
        limit: Area above which no cut is wanted [m2].
    """
    _clear_flow(graph)
    total = 0.0
    while total <= limit and _level(graph, body, visits):
        for i in range(graph.n_terminals):
            if graph.lip[graph.terminals[i]] > 0:
                total += _fill_paths(graph, body, visits, graph.terminals[i], limit - total)
                if total > limit:
                    return total
    return total


@kernel
def _clear_flow(graph: FlowGraph) -> None:
    for i in range(graph.n_carriers):
        t = graph.carriers[i]
        graph.has_flow[t] = 0
        for f in range(4):
            graph.flow[t, f] = 0.0
    graph.n_carriers = 0


@kernel
def _left(graph: FlowGraph, body: Body, t: int, f: int) -> float:
    """Return the capacity left from `t` through its face `f` [m2], 0 where it is only rounding."""
    area = face_area(body.rest, body.tetrahedra, t, f)
    if body.n_rigid > 0 and body.is_rigid[t] and body.is_rigid[body.links[t, f] // 4]:
        area *= OF_CORE
    left = area - graph.flow[t, f]
    return left if left > ROUNDED_AREA * area else 0.0


@kernel
def _level(graph: FlowGraph, body: Body, visits: Visits) -> bool:
    """Visit what flow from lip +1 can reach; return whether it reaches lip -1."""
    visits.epoch += 1
    epoch = visits.epoch
    graph.n_queued = 0
    for i in range(graph.n_terminals):
        if graph.lip[graph.terminals[i]] > 0:
            _visit(graph, visits, graph.terminals[i], 0)
    reached = -1
    i = 0
    while i < graph.n_queued:
        t = graph.queue[i]
        i += 1
        if reached >= 0 and graph.level[t] >= reached:
            break  # paths through here would not be shortest
        for f in range(4):
            link = body.links[t, f]
            if link < 0 or visits.tetrahedra[link // 4] == epoch:
                continue
            if _left(graph, body, t, f) > 0.0:
                _visit(graph, visits, link // 4, graph.level[t] + 1)
                if graph.lip[link // 4] < 0:
                    reached = graph.level[t] + 1
    return reached >= 0


@kernel
def _visit(graph: FlowGraph, visits: Visits, t: int, level: int) -> None:
    visits.tetrahedra[t] = visits.epoch
    graph.level[t] = level
    graph.next_face[t] = 0
    graph.queue[graph.n_queued] = t
    graph.n_queued += 1


@kernel
def _fill_paths(graph: FlowGraph, body: Body, visits: Visits, source: int, limit: float) -> float:
    """Fill the shortest paths from `source` to lip -1; return what flows through them [m2].

    Args:
        graph: Levelled; the flow is written.
        body: The tissue.
        visits: Marks which tetrahedra were visited.
        source: A tetrahedron of lip +1.
        limit: Flow above which the search ends [m2].
    """
    total = 0.0
    depth = 0
    t = source
    while total <= limit:
        if graph.lip[t] < 0:
            total += _send(graph, body, depth)
            depth, t = 0, source
            continue
        half = _next_half(graph, body, visits, t)
        if half >= 0:
            graph.stack[depth] = half
            depth += 1
            t = body.links[t, half % 4] // 4
        elif depth == 0:
            return total
        else:
            depth -= 1
            t = graph.stack[depth] // 4
            graph.next_face[t] += 1
    return total


@kernel
def _next_half(graph: FlowGraph, body: Body, visits: Visits, t: int) -> int:
    """Return the face of `t` through which a shortest path may continue, -1 if there is none."""
    while graph.next_face[t] < 4:
        f: int = graph.next_face[t]
        link = body.links[t, f]
        if (
            link >= 0
            and visits.tetrahedra[link // 4] == visits.epoch
            and graph.level[link // 4] == graph.level[t] + 1
            and _left(graph, body, t, f) > 0.0
        ):
            return 4 * t + f
        graph.next_face[t] += 1
    return -1


@kernel
def _send(graph: FlowGraph, body: Body, depth: int) -> float:
    """Send as much as fits through the path in `stack`; return how much [m2]."""
    amount = np.inf
    for i in range(depth):
        half = graph.stack[i]
        amount = min(amount, _left(graph, body, half // 4, half % 4))
    for i in range(depth):
        half = graph.stack[i]
        back = body.links[half // 4, half % 4]
        graph.flow[half // 4, half % 4] += amount
        graph.flow[back // 4, back % 4] -= amount
        for t in (half // 4, back // 4):
            if graph.has_flow[t] == 0:
                graph.has_flow[t] = 1
                graph.carriers[graph.n_carriers] = t
                graph.n_carriers += 1
    return amount
