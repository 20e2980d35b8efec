"""Sleeping: nodes at rest are not moved until something pulls on them.

An awake node moves. A watched node is asleep beside one that is awake: it does not move, but its
acceleration is computed, and wakes it. All others are asleep and cost nothing, so that a step
costs what the nodes in the list cost, however large the body is.

A sleeping node is held in its place. The force that this takes is at most its mass times
`WAKE_ACCELERATION`, 2 % of its weight: what sleeps is displaced from equilibrium by no more than
that share of the sag under its own weight. The momentum that it had when it fell
asleep is at most its mass times `SLEEP_SPEED`, and is summed up.
"""

import numpy as np

from tissue.contact.constraints import Contacts
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, IntCell
from tissue.core.vec3 import Vec3, dot, vec3
from tissue.elasticity.springs import Springs
from tissue.mesh.body import Body, grown

ASLEEP, WATCHED, AWAKE = 0, 1, 2
"""State of a node."""

SLEEP_ACCELERATION = 0.1
"""Net acceleration below which a node may fall asleep [m/s2]: a hundredth of that of its weight.
Larger: bodies come to rest visibly short of equilibrium, and what is pressed is held by the
nodes asleep around it. Smaller: the waves of a cut keep a large body awake; of 51,000 nodes 400 ms
after
a slit of 40 ms 50,000 were awake at 0.01, 33,000 at 0.05, 5,000 at 0.25."""

WAKE_ACCELERATION = 2.0 * SLEEP_ACCELERATION
"""Net acceleration that wakes a node [m/s2]. As small as the other, nodes would wake at once."""

SLEEP_SPEED = 1e-4
"""Speed below which a node may fall asleep [m/s]: a tenth of a micrometre a millisecond."""

CALM = 0.05
"""How long a node must be slow before it sleeps [s]. A swing passes through slow and unaccelerated
instants; tissue swings at 5 to 50 Hz, so that this is a good part of a period."""


class Activity(Arrays):
    """The list of nodes that are awake or watched, in the order in which they came in."""

    listed: IntArray
    """Nodes, shape (capacity,)."""
    state: IntArray
    """ASLEEP, WATCHED or AWAKE, shape (capacity,)."""
    calm: FloatArray
    """How long each has been calm [s], shape (capacity,)."""
    n_listed: IntCell
    """Number of nodes listed."""
    n_awake: IntCell
    """Number of them that are awake."""
    version: IntCell
    """Number of changes of the list so far."""
    given_up: FloatArray
    """Sum of the momenta that nodes had when they fell asleep [kg m/s], shape (3,)."""


def all_asleep(n_nodes: int) -> Activity:
    """Return the activity of that many nodes, none of which is awake."""
    return Activity(
        listed=np.zeros(n_nodes, np.int64),
        state=np.zeros(n_nodes, np.int64),
        calm=np.zeros(n_nodes),
        n_listed=0,
        n_awake=0,
        version=0,
        given_up=np.zeros(3),
    )


def grown_activity(activity: Activity, n_nodes: int) -> Activity:
    """Return the activity with room for that many nodes; new ones are asleep."""
    of_nodes = ("listed", "state", "calm")
    return activity.replaced(**{name: grown(getattr(activity, name), n_nodes) for name in of_nodes})


@kernel
def wake(activity: Activity, body: Body, springs: Springs, node: int) -> None:
    """Wake a node, and watch its neighbours; it does not sleep before it has been calm again."""
    activity.calm[node] = 0.0
    if activity.state[node] == AWAKE or body.fixed[node]:
        return
    _list(activity, node)
    activity.state[node] = AWAKE
    activity.n_awake += 1
    first = springs.first[node]
    for slot in range(first, first + springs.count[node]):
        _list(activity, springs.neighbour[slot])


@kernel
def wake_each(activity: Activity, body: Body, springs: Springs, nodes: IntArray, n: int) -> None:
    """Wake the first `n` of `nodes`.

    Args:
        activity: The list of awake and watched nodes.
        body: For the fixed nodes.
        springs: The rows of neighbours.
        nodes: Nodes to wake.
        n: Number of them.
    """
    for i in range(n):
        wake(activity, body, springs, nodes[i])


@kernel
def wake_all(activity: Activity, body: Body, springs: Springs) -> None:
    """Wake every node: gravity or the fixed nodes have changed."""
    for node in range(body.n_nodes):
        wake(activity, body, springs, node)


@kernel
def _list(activity: Activity, node: int) -> None:
    if activity.state[node] == ASLEEP:
        activity.state[node] = WATCHED
        activity.listed[activity.n_listed] = node
        activity.n_listed += 1
        activity.version += 1


@kernel
def wake_pulled(
    activity: Activity, body: Body, springs: Springs, accelerations: FloatArray
) -> None:
    """Wake every watched node whose acceleration [m/s2] says so."""
    for k in range(activity.n_listed):
        node = activity.listed[k]
        if activity.state[node] == WATCHED and not body.fixed[node]:
            a = vec3(accelerations, node)
            if dot(a, a) > WAKE_ACCELERATION * WAKE_ACCELERATION:
                wake(activity, body, springs, node)


@kernel
def wake_touching(activity: Activity, body: Body, springs: Springs, contacts: Contacts) -> None:
    """Wake every node of a contact."""
    for k in range(contacts.n_contacts):
        for q in range(4):
            wake(activity, body, springs, contacts.node[k, q])


@kernel
def doze(
    activity: Activity,
    body: Body,
    springs: Springs,
    accelerations: FloatArray,
    seconds: float,
) -> None:
    """Put nodes to sleep that were calm for `CALM`; drop watched ones with none awake beside them.

    Args:
        activity: The list is compacted, in its order.
        body: Velocities of nodes that fall asleep are set to zero.
        springs: The rows of neighbours.
        accelerations: Accelerations of the last step [m/s2], shape (capacity, 3).
        seconds: Time since the last call [s].
    """
    for k in range(activity.n_listed):
        node = activity.listed[k]
        if activity.state[node] != AWAKE:
            continue
        v = vec3(body.velocities, node)
        a = vec3(accelerations, node)
        is_slow = dot(v, v) <= SLEEP_SPEED * SLEEP_SPEED
        is_free = dot(a, a) <= SLEEP_ACCELERATION * SLEEP_ACCELERATION
        if not (is_slow and is_free):
            activity.calm[node] = 0.0
            continue
        activity.calm[node] += seconds
        if activity.calm[node] >= CALM:
            _fall_asleep(activity, body, node, v)
    kept = 0
    for k in range(activity.n_listed):
        node = activity.listed[k]
        if activity.state[node] == WATCHED and not _beside_awake(activity, springs, node):
            activity.state[node] = ASLEEP
            continue
        activity.listed[kept] = node
        kept += 1
    if kept < activity.n_listed:
        activity.n_listed = kept
        activity.version += 1


@kernel
def _fall_asleep(activity: Activity, body: Body, node: int, v: Vec3) -> None:
    activity.state[node] = WATCHED
    activity.n_awake -= 1
    for c in range(3):
        activity.given_up[c] += body.masses[node] * v[c]
        body.velocities[node, c] = 0.0


@kernel
def _beside_awake(activity: Activity, springs: Springs, node: int) -> bool:
    first = springs.first[node]
    for slot in range(first, first + springs.count[node]):
        if activity.state[springs.neighbour[slot]] == AWAKE:
            return True
    return False
