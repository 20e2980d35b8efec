"""Networks of springs advanced by the kernels of the hierarchical stepper, without `Tissue`."""

import numpy as np

from tests.support import bodies
from tests.tissue.kernels_of import Network, network_of
from tissue import BoolArray, FloatArray, Hierarchical
from tissue.blade.edge import NOWHERE
from tissue.core.vec3 import Vec3
from tissue.elasticity.internal_forces import Surroundings
from tissue.integrators.bielser_1998.kernels import (
    FrameTimes,
    LocalClocks,
    hierarchical_frame,
    new_local_clocks,
)
from tissue.integrators.bielser_1998.rings import (
    Rings,
    add_focus,
    begin_search,
    new_rings,
    search,
)
from tissue.integrators.bielser_1998.stepper import ring_steps

FREE_FALL = Vec3(0.0, 0.0, -9.81)


def block(
    n: int,
    *,
    held: bool = True,
    gravity: Vec3 = Vec3(0.0, 0.0, 0.0),
    drag: float = 0.0,
    retardation_time: float = 0.0,
) -> Network:
    """Return a box of n x n x n jittered cells, held at two sides or free."""
    mesh = bodies.jittered_grid(n, 0)
    network = network_of(mesh, bodies.sides(mesh) if held else None)
    return network._replace(
        surroundings=Surroundings(gravity=gravity, drag=drag, retardation_time=retardation_time)
    )


def nearest(network: Network, point: FloatArray) -> int:
    """Return the node whose rest position is nearest to a point [m]."""
    return int(np.argmin(np.linalg.norm(network.body.rest - point, axis=1)))


def rings_around(network: Network, node: int, last_ring: int) -> Rings:
    """Return the rings around one node, up to `last_ring`."""
    rings = new_rings(len(network.body.rest))
    begin_search(rings)
    add_focus(rings, node)
    search(rings, network.springs, last_ring)
    return rings


def found_nodes(rings: Rings) -> list[int]:
    """Return the nodes that a ring search found, in order."""
    return rings.order[: rings.n_found].tolist()


def hierarchical_frames(
    network: Network,
    focus: int,
    span: float,
    n: int,
    updates: int,
    last_ring: int,
    frozen: bool,
    local_clocks: LocalClocks | None = None,
) -> None:
    """Advance by frames of the hierarchical relaxation.

    Args:
        network: The network to advance.
        focus: Node in the middle of the rings.
        span: Length of a frame [s].
        n: Number of frames.
        updates: Steps of ring 0 in a frame.
        last_ring: Last ring that takes steps of its own.
        frozen: Whether nodes beyond the last ring do not move.
        local_clocks: Scratch of the kernels, made if not given.
    """
    n_nodes = len(network.body.rest)
    rings = rings_around(network, focus, last_ring + 1)
    local_clocks = local_clocks or new_local_clocks(n_nodes)
    n_micro, every = ring_steps(Hierarchical(updates, last_ring), [0.0] * (last_ring + 2))
    frame = FrameTimes(span, 0.0, 1.0, n_micro, last_ring, frozen)
    context = network.context
    for _ in range(n):
        hierarchical_frame(context, NOWHERE, rings, local_clocks, every, frame)


def frequency_bound(network: Network) -> float:
    """Return the bound on the angular frequency of the free nodes [1/s]."""
    free = ~network.body.fixed
    return float(np.sqrt(network.springs.frequency_squared[free].max()))


def shake(network: Network, size: float) -> None:
    """Displace the free nodes by waves of amplitude `size` [m], and set all velocities to zero."""
    body = network.body
    free: BoolArray = ~body.fixed
    body.positions[:] = body.rest + size * np.sin(200.0 * body.rest)[:, [1, 2, 0]] * free[:, None]
    body.velocities[:] = 0.0
