"""What a Runge-Kutta step of springs must move and compute, counted stage by stage.

Counted by hand from `tissue.elasticity.spring_forces` and `tissue.integrators.runge_kutta`, as the
loops are written: a
change of either is a change here. What a row gathers of its neighbours is not counted as bytes: the
same sweep reads them anyway.
"""

from typing import NamedTuple

from tissue.core.simd import WIDTH

VECTOR = 24
"""Bytes of a position, velocity or force."""
NODE = 8 + 8 + 8 + 1
"""Bytes of a node's row (where, how long), its mass, and whether it is held."""
ELASTIC_SLOT = 4 + 8 + 8
"""Bytes of a place in a row: neighbour, stiffness, rest pull."""
DAMPING_SLOT = 4 + 8
"""Without the rest pull."""


class Sweep(NamedTuple):
    """One stage, over all rows."""

    slot_bytes: int
    """Of each place in a row."""
    slot_flops: int
    """A square root or a division counts as one."""
    vectors: int
    """Read or written, of each node."""
    node_flops: int
    """Besides those of its row."""


_FIRST, _LAST = (3 + 3, 34), (3 + 2, 22)
DAMPED = (
    Sweep(ELASTIC_SLOT, 32, *_FIRST),
    Sweep(ELASTIC_SLOT, 32, 3 + 1 + 2, 22),
    Sweep(DAMPING_SLOT, 25, 3 + 3 + 4, 58),
    Sweep(ELASTIC_SLOT, 32, *_LAST),
)
"""Forces and dampers at three positions, and dampers once more at the second of them."""
_UNDAMPED = (
    Sweep(ELASTIC_SLOT, 18, *_FIRST),
    Sweep(ELASTIC_SLOT, 18, 3 + 3 + 4, 70),
    Sweep(ELASTIC_SLOT, 18, *_LAST),
)
"""Without dampers the second and the third acceleration are one."""

VECTORS_OF_A_NODE = 9
"""Positions, velocities, and the seven of scratch: what a step touches."""


class Traffic(NamedTuple):
    """What one step must move and compute."""

    n_springs: int
    n_slots: int
    """Places in the rows: each spring has two, and rows are filled up to whole vectors."""
    n_bytes: int
    """Read and written by one step, if nothing stayed in a cache from stage to stage."""
    n_flops: int
    """Of one step."""
    working_set: int
    """Bytes of all arrays that a step touches: the cache that holds them feeds it."""


def traffic(row_lengths: list[int], *, is_damped: bool) -> Traffic:
    """Return the traffic of a step of nodes with so many springs each."""
    n_nodes = len(row_lengths)
    n_slots = sum(-(-length // WIDTH) * WIDTH for length in row_lengths)
    sweeps = DAMPED if is_damped else _UNDAMPED
    return Traffic(
        n_springs=sum(row_lengths) // 2,
        n_slots=n_slots,
        n_bytes=sum(
            sweep.slot_bytes * n_slots + (VECTOR * sweep.vectors + NODE) * n_nodes
            for sweep in sweeps
        ),
        n_flops=sum(sweep.slot_flops * n_slots + sweep.node_flops * n_nodes for sweep in sweeps),
        working_set=ELASTIC_SLOT * n_slots + (VECTOR * VECTORS_OF_A_NODE + NODE) * n_nodes,
    )
