"""What a Runge-Kutta step of springs must move and compute, counted stage by stage.

The numbers are counted by hand from `tissue.elasticity.spring_forces` and
`tissue.integrators.nystroem`, as the loops are written: a change of either is a change here.
What a row gathers from its neighbours is not counted as bytes: the same pass over the nodes reads
them anyway.
"""

from typing import NamedTuple

from benchmarks.engine import VECTOR_LENGTH

VECTOR_BYTES = 24
"""Bytes of a position, velocity or force."""
NODE_BYTES = 8 + 8 + 8 + 1
"""Bytes of a node's row (start and length), its mass, and whether it is held."""
ELASTIC_SLOT_BYTES = 4 + 8 + 8
"""Bytes of a slot of a row: neighbour, stiffness, rest pull."""
DAMPING_SLOT_BYTES = 4 + 8
"""Bytes of a slot of a row without the rest pull."""


class StageCost(NamedTuple):
    """What one stage of the step moves and computes, as it passes over all rows."""

    slot_bytes: int
    """Bytes of each slot of a row."""
    slot_flops: int
    """Operations for each slot; a square root or a division counts as one."""
    node_vectors: int
    """Vectors of each node that are read or written."""
    node_flops: int
    """Operations for each node besides those of its row."""


_UNDAMPED_STAGES = (
    StageCost(ELASTIC_SLOT_BYTES, 18, 3 + 3, 34),
    StageCost(ELASTIC_SLOT_BYTES, 18, 3 + 3 + 3, 46),
    StageCost(ELASTIC_SLOT_BYTES, 18, 3 + 4 + 2, 64),
)
DAMPED_STAGES = (*_UNDAMPED_STAGES, StageCost(DAMPING_SLOT_BYTES, 25, 2 + 1 + 3, 20))
"""Forces at three positions, and dampers once a step."""

VECTORS_PER_NODE = 9
"""Vectors of a node that a step touches: position, velocity, and seven of scratch."""


class StepTraffic(NamedTuple):
    """What one step must move and compute."""

    n_springs: int
    n_slots: int
    """Slots in the rows: each spring has two, and rows are filled up to whole vectors."""
    n_bytes: int
    """Bytes that a step reads and writes, if nothing stayed in a cache from stage to stage."""
    n_flops: int
    """Operations of a step."""
    working_set: int
    """Bytes of all arrays that a step touches: the cache that holds them feeds it."""


def step_traffic(row_lengths: list[int], *, is_damped: bool) -> StepTraffic:
    """Return the traffic of a step of nodes with these numbers of springs."""
    n_nodes = len(row_lengths)
    n_slots = sum(-(-length // VECTOR_LENGTH) * VECTOR_LENGTH for length in row_lengths)
    stages = DAMPED_STAGES if is_damped else _UNDAMPED_STAGES
    return StepTraffic(
        n_springs=sum(row_lengths) // 2,
        n_slots=n_slots,
        n_bytes=sum(
            stage.slot_bytes * n_slots + (VECTOR_BYTES * stage.node_vectors + NODE_BYTES) * n_nodes
            for stage in stages
        ),
        n_flops=sum(stage.slot_flops * n_slots + stage.node_flops * n_nodes for stage in stages),
        working_set=ELASTIC_SLOT_BYTES * n_slots
        + (VECTOR_BYTES * VECTORS_PER_NODE + NODE_BYTES) * n_nodes,
    )
