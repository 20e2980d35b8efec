"""Pairing: searches the grids for what is near the marked nodes and dirty faces."""

from tissue.contact.candidates import Candidates, is_marked
from tissue.contact.distance import distance_of_edges, distance_to_triangle
from tissue.contact.edge_edge import Edges
from tissue.contact.faces import Faces
from tissue.contact.pairs import add_pair
from tissue.contact.point_triangle import Corners, rim_width
from tissue.contact.spatial_hash import find_overlaps, insert_box
from tissue.core.jit import kernel
from tissue.core.vec3 import vec3
from tissue.geometry.aabb import box_at, widened
from tissue.mesh.body import Body


@kernel
def owns_edge(candidates: Candidates, at: int, k: int) -> bool:
    """Whether edge `k` of the triangle in place `at` goes from its lower node to its higher."""
    return bool(candidates.triangle[at, k] < candidates.triangle[at, (k + 1) % 3])


@kernel
def pair_dirty(candidates: Candidates, faces: Faces, body: Body, reach: float) -> bool:
    """Pair marked nodes and dirty faces, and insert them into the grids; False if there is no room.

    Args:
        candidates: Pairs are added.
        faces: The faces that may touch.
        body: For the piece that each node is in.
        reach: Distance up to which sides are paired [m].
    """
    for i in range(candidates.n_nodes):
        node = candidates.node[i]
        if is_marked(candidates, node) and not _pair_node(candidates, faces, body, node, reach):
            return False
    for i in range(candidates.n_dirty):
        at = candidates.dirty[i]
        if candidates.is_active[at] == 0:
            continue
        if not _pair_triangle(candidates, faces, body, at, reach):
            return False
        for k in range(3):
            if candidates.has_edge[3 * at + k] == 1 and not _pair_edge(
                candidates, faces, 3 * at + k, reach
            ):
                return False
    return True


@kernel
def _pair_node(candidates: Candidates, faces: Faces, body: Body, node: int, reach: float) -> bool:
    """Pair a node with the triangles that are in the grid, and insert it."""
    box = box_at(candidates.reference, candidates.reference, node)
    low, high, search = candidates.triangle_low, candidates.triangle_high, candidates.search
    n = find_overlaps(candidates.triangles, search, low, high, widened(box, reach))
    for i in range(n):
        if not _add_point(candidates, faces, body, node, search.found[i], reach):
            return False
    return insert_box(candidates.points, node, box)


@kernel
def _pair_triangle(candidates: Candidates, faces: Faces, body: Body, at: int, reach: float) -> bool:
    """Pair a triangle with the nodes, which are all in the grid, and insert it."""
    x, search = candidates.reference, candidates.search
    box = box_at(candidates.triangle_low, candidates.triangle_high, at)
    n = find_overlaps(candidates.points, search, x, x, widened(box, reach))
    for i in range(n):
        if not _add_point(candidates, faces, body, search.found[i], at, reach):
            return False
    return insert_box(candidates.triangles, at, box)


@kernel
def _pair_edge(candidates: Candidates, faces: Faces, edge: int, reach: float) -> bool:
    """Pair an edge with those that are in the grid, and insert it."""
    low, high, search = candidates.edge_low, candidates.edge_high, candidates.search
    box = box_at(low, high, edge)
    n = find_overlaps(candidates.edges, search, low, high, widened(box, reach))
    for i in range(n):
        if not _add_edges(candidates, faces, edge, search.found[i], reach):
            return False
    return insert_box(candidates.edges, edge, box)


@kernel
def _add_point(
    candidates: Candidates, faces: Faces, body: Body, node: int, at: int, reach: float
) -> bool:
    """Add a pair of node and triangle if they may touch; return False if there is no room."""
    a, b, c = candidates.triangle[at, 0], candidates.triangle[at, 1], candidates.triangle[at, 2]
    if node in (a, b, c):
        return True
    piece = faces.piece[body.node_tetrahedron[node]]
    of_cuts = candidates.n_cut_around[node] > 0 and candidates.is_of_cut[at] == 1
    if not of_cuts and _are_one_piece(piece, faces.piece[faces.face[at] // 4]):
        return True
    x = candidates.reference
    corners = Corners(vec3(x, node), vec3(x, a), vec3(x, b), vec3(x, c))
    if distance_to_triangle(corners) > reach + rim_width(corners.a, corners.b, corners.c):
        return True
    generation = candidates.node_generation[node] + candidates.generation[at]
    return add_pair(candidates.point_triangle, (node, a, b, c), node, at, generation)


@kernel
def _add_edges(candidates: Candidates, faces: Faces, edge: int, other: int, reach: float) -> bool:
    """Add a pair of edges if they may touch; return False if there is no room."""
    at, beside = edge // 3, other // 3
    k, m = edge % 3, other % 3
    a, b = candidates.triangle[at, k], candidates.triangle[at, (k + 1) % 3]
    c, d = candidates.triangle[beside, m], candidates.triangle[beside, (m + 1) % 3]
    if a in (c, d) or b in (c, d):
        return True
    of_cuts = candidates.is_of_cut[at] == 1 and candidates.is_of_cut[beside] == 1
    piece, other_piece = faces.piece[faces.face[at] // 4], faces.piece[faces.face[beside] // 4]
    if not of_cuts and _are_one_piece(piece, other_piece):
        return True
    x = candidates.reference
    if distance_of_edges(Edges(vec3(x, a), vec3(x, b), vec3(x, c), vec3(x, d))) > reach:
        return True
    generation = candidates.generation[at] + candidates.generation[beside]
    nodes = (a, b, c, d) if a < c else (c, d, a, b)
    return add_pair(candidates.edge_edge, nodes, edge, other, generation)


@kernel
def _are_one_piece(piece: int, other: int) -> bool:
    """Whether both are known to be in one piece, of which only faces of cuts touch."""
    return piece == other and piece >= 0
