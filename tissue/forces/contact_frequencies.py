"""Contribution of contact to the frequency of each node that it touches.

The springs of contacts add at most W_i^2 to w^2 of node i (`tissue.contact.response.stiffness`),
and the body has at most b_i there (`tissue.elasticity.frequency.at_rest`): both bound the energy by
sums over nodes, so that no mode is faster than the largest b_i + W_i^2. That is far below the sum
of both maxima where few nodes are as fast as the fastest: they get mass, as where strain or the
blade makes them fast, and the body takes no more steps for its contacts.
"""

from tissue.contact.response.stiffness import Limits, frequency_of_contact
from tissue.contact.search.search_state import SearchState
from tissue.contact.search_stages import added_frequency
from tissue.core.jit import kernel
from tissue.elasticity.frequency.changes import return_mass
from tissue.elasticity.frequency.strained import bound_tetrahedra, forget_tests
from tissue.forces.step_context import StepContext


@kernel
def frequency_of_contacts(context: StepContext, search: SearchState, limits: Limits) -> float:
    """Return what contacts add to w^2 of the body where that of its nodes is not known [1/s2].

    Where nodes in contact may get mass it is written for each node, and 0 is returned.

    Args:
        context: Body, contacts and bounds; written where contacts are new.
        search: Whether there are any.
        limits: What they were made with.
    """
    if limits.adds_mass == 0:
        return added_frequency(search, limits)
    has_ended = search.n_found == 0 and context.elastic.n_touching > 0
    if limits.is_listed == 1 or has_ended:
        limits.is_listed = 0
        _take_contacts(context, limits)
    return 0.0


@kernel
def _take_contacts(context: StepContext, limits: Limits) -> None:
    """Write what contacts add to w^2 of each node.

    Nodes that touch nothing any more give back mass that they do not need at rest.
    """
    elastic, body, visits = context.elastic, context.body, context.visits
    contacts, changed, n = context.contacts, context.elastic.solid.listed, 0
    n_nodes = contacts.n_nodes if contacts.n_contacts > 0 else 0
    visits.epoch += 1
    for i in range(n_nodes):
        visits.nodes[contacts.touching[i]] = visits.epoch
    for i in range(elastic.n_touching):
        node = elastic.touching[i]
        if visits.nodes[node] != visits.epoch:
            elastic.of_contact[node] = 0.0
            changed[n] = node
            n += 1
    if n > 0:
        return_mass(elastic, body, changed, n)
    n = 0
    elastic.n_touching, elastic.allowed_touching = 0, limits.highest + limits.added
    for i in range(n_nodes):
        node = contacts.touching[i]
        if body.fixed[node]:
            continue
        added = frequency_of_contact(limits, elastic.frequency_squared[node])
        if added != elastic.of_contact[node]:
            elastic.of_contact[node] = added
            changed[n] = node
            n += 1
        elastic.touching[elastic.n_touching] = node
        elastic.n_touching += 1
    if n > 0:
        bound_tetrahedra(elastic, body, changed, n)
        forget_tests(elastic.solid, changed, n)
