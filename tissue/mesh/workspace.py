"""Room in the arrays of a body for the nodes and tetrahedra that a cut adds."""

from tissue.mesh.body import Body

PASS_NODES = 256
"""Nodes that one pass of a cut step puts on the sheet at most; a step that needs more takes several
passes. Doubling a node changes some 50 tetrahedra, which must fit into `CHANGES`."""

SPARE_NODES = 4 * PASS_NODES
"""Room that a pass leaves for doubled nodes: no node becomes more than a few."""

ROOM_FOR_TETRAHEDRA = 1 << 12
"""Free tetrahedra that a pass of a cut step begins with; more are made between passes."""


def room_for_a_pass(body: Body, factor: int = 1) -> tuple[int, int] | None:
    """Return the numbers of nodes and tetrahedra to make room for before a pass; None to keep them.

    Arrays double when they are nearly full.

    Args:
        body: The body.
        factor: How many times as many nodes as usual may be doubled in the pass.
    """
    capacity = n_nodes, n_tetrahedra = len(body.rest), len(body.tetrahedra)
    spare = 2 * SPARE_NODES * factor
    if body.n_nodes + spare > n_nodes:
        n_nodes = 2 * n_nodes + spare
    if body.n_tetrahedra + ROOM_FOR_TETRAHEDRA > n_tetrahedra:
        n_tetrahedra = 2 * n_tetrahedra + ROOM_FOR_TETRAHEDRA
    return (n_nodes, n_tetrahedra) if (n_nodes, n_tetrahedra) != capacity else None
