"""The blade in the tissue: its edge, which cuts, and its faces, which part what is cut."""

from tissue.blade.anchors import (
    Anchors,
    Edge,
    add_stiffness,
    anchors_energy,
    clear_forces,
    highest_frequency,
    measure_speeds,
    pull,
)
from tissue.blade.impulse_totals import (
    RELEASED,
    WORK_OF_BLADE,
    WORK_OF_BREAKING,
)
from tissue.blade.return_mapping import slip
from tissue.blade.side_contact import (
    Flanks,
    add_flank_stiffness,
    clear_flanks,
    highest_flank_frequency,
    press_flanks,
    slide_flanks,
)
from tissue.blade.toughness import Resistance
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays
from tissue.mesh.body import Body
from tissue.mesh.star import Visits


class Tool(Arrays):
    """All through which blade and tissue act on each other."""

    anchors: Anchors
    flanks: Flanks
    resistance: Resistance


@kernel
def clear_tool(tool: Tool, body: Body, external: FloatArray) -> None:
    """Set the forces on the nodes that the blade acts on to zero: the others are zero anyway."""
    clear_forces(tool.anchors, body, external)
    clear_flanks(tool.flanks, external)


@kernel
def begin_step(tool: Tool, body: Body, edge: Edge, dt: float) -> None:
    """Begin to count impulse and area; measure how fast the edge goes in this step of `dt` [s]."""
    anchors = tool.anchors
    for i in range(WORK_OF_BLADE):
        anchors.totals[i] = 0.0
    for k in range(len(anchors.state)):
        anchors.cut[k] = 0.0
    before = anchors_energy(anchors, body, edge, 0.0, tool.resistance)
    measure_speeds(anchors, edge, dt)
    # An edge that slows down meets less: what it holds too much, it is about to cut.
    after = anchors_energy(anchors, body, edge, 0.0, tool.resistance)
    anchors.totals[WORK_OF_BREAKING] += before - after


@kernel
def act(
    tool: Tool,
    body: Body,
    edge: Edge,
    positions: FloatArray,
    when: float,
    share: float,
    dt: float,
    external: FloatArray,
) -> None:
    """Write the blade's forces on the nodes to `external` [N] and count impulse and work.

    Args:
        tool: Its totals are written.
        body: For the nodes.
        edge: The cutting edge over the step.
        positions: Where the nodes are [m].
        when: Instant, as a fraction of the step.
        share: Weight of this evaluation in the integral over the step; they add up to 1.
        dt: Length of the step [s].
        external: Forces on the nodes; cleared first.
    """
    clear_tool(tool, body, external)
    anchors = tool.anchors
    pull(anchors, body, edge, positions, when, share, dt, tool.resistance, external)
    press_flanks(tool.flanks, edge, positions, when, share, dt, external, anchors.totals)


@kernel
def give_way(
    tool: Tool,
    body: Body,
    visits: Visits,
    edge: Edge,
    external: FloatArray,
    when: float,
    seconds: float,
    reach: float,
    queue: IntArray,
) -> None:
    """After a step: let slip and slide what does not hold. Clears `external` [N].

    Args:
        tool: Written.
        body: The tissue.
        visits: For searches.
        edge: The cutting edge over the time step.
        external: Forces on the nodes.
        when: Instant, as a fraction of the time step.
        seconds: Since the last call [s].
        reach: See `slip` [m].
        queue: Scratch.
    """
    clear_tool(tool, body, external)  # before anchors go to other nodes
    slip(tool.anchors, body, visits, edge, when, tool.resistance, reach, queue)
    slide_flanks(tool.flanks, edge, body.positions, when, seconds, tool.anchors.totals)


@kernel
def release_edge(tool: Tool, body: Body, edge: Edge, when: float) -> None:
    """Count the energy of all that the edge holds as released: the blade is taken away."""
    anchors = tool.anchors
    anchors.totals[RELEASED] += anchors_energy(anchors, body, edge, when, tool.resistance)


@kernel
def add_tool_frequency(
    tool: Tool, body: Body, frequency_squared: FloatArray, scratch: FloatArray
) -> None:
    """Add what the blade adds to the bound on w^2 [1/s2] of each node that it acts on.

    `scratch` as in `frequency_with_tool`.
    """
    anchors, flanks = tool.anchors, tool.flanks
    add_stiffness(anchors, body, scratch)
    add_flank_stiffness(flanks, scratch)
    for k in range(len(anchors.state)):
        for q in range(4):
            _add_frequency(
                body, frequency_squared, scratch, body.tetrahedra[anchors.tetrahedron[k], q]
            )
    for i in range(flanks.count[0]):
        for corner in range(3):
            _add_frequency(body, frequency_squared, scratch, flanks.node[i, corner])


@kernel
def _add_frequency(
    body: Body, frequency_squared: FloatArray, scratch: FloatArray, node: int
) -> None:
    """Add the stiffness at a node to its bound, once: it is zero afterwards."""
    frequency_squared[node] += scratch[node, 0] / body.masses[node]
    scratch[node, 0] = 0.0


@kernel
def frequency_with_tool(
    tool: Tool, body: Body, frequency_squared: FloatArray, scratch: FloatArray
) -> float:
    """Bound on w^2 [1/s2] over the nodes that the blade acts on: body and blade together.

    `scratch`, shape (capacity, 3), must be zero at those nodes and is so again afterwards.
    """
    add_stiffness(tool.anchors, body, scratch)
    add_flank_stiffness(tool.flanks, scratch)
    worst = max(
        highest_frequency(tool.anchors, body, frequency_squared, scratch),
        highest_flank_frequency(tool.flanks, body, frequency_squared, scratch),
    )
    clear_tool(tool, body, scratch)
    return worst
