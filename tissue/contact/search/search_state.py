"""`SearchState`: all that the search for contacts reads and writes, besides the body."""

from tissue.contact.geometry.faces import Faces
from tissue.contact.search.edge_pairs import EdgePairs
from tissue.contact.search.feature_edges import FeatureEdges
from tissue.contact.search.near_pairs import NearPairs
from tissue.contact.search.node_motion import NodeMotion
from tissue.contact.search.self_proximity import SelfProximity
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import kernel
from tissue.core.structs import Arrays, FloatCell, IntCell

_MANY_MOVING = 4
"""One over the share of moving nodes from which on it is cheaper to test all."""


class SearchState(Arrays):
    """Data of the search for contacts, besides the body and the contacts."""

    step: IntCell
    """Number of times that normals were computed."""
    turn: IntCell
    """Tetrahedron that `penetrating_nodes` searches next."""
    n_rounds: IntCell
    """Number of the round in which `penetrating_nodes` searches all tetrahedra, from 1."""
    n_listings: IntCell
    """Number of times that contacts were listed."""
    stage: IntCell
    """Stage at which a search begins or, where it stopped for want of room, continues: a value of
    `search`."""
    is_pairing: IntCell
    """1 if pairs are updated in this search, else 0."""
    is_pairing_due: IntCell
    """1 if pairs are to be updated whatever has moved, else 0."""
    has_new_faces: IntCell
    """1 if a cut has changed faces since pairs were updated, else 0."""
    is_listing_due: IntCell
    """1 if contacts are to be listed whatever has moved, else 0."""
    since_pairing: IntCell
    """Number of searches since pairs were updated."""
    since_normals: IntCell
    """Number of searches since normals were computed."""
    n_due: IntCell
    """Number of nodes whose contacts are sought in this search."""
    acts: IntCell
    """1 if there is contact, else 0: then nothing ever touches."""
    is_awake: IntCell
    """1 once anything could touch, else 0."""
    is_tested: IntCell
    """1 if that was tested in this time step, else 0."""
    is_searched: IntCell
    """1 if contacts were searched in this time step, and no cut came since, else 0."""
    has_touched: IntCell
    """1 if there were contacts in this time step, else 0."""
    n_found: IntCell
    """Number of contacts after the last search; some are kept ready."""
    all_resting_until: FloatCell
    """Value of `NodeMotion.quiet_path` up to which no node needs a test while no node moves much
    [m]."""
    faces: Faces
    pairs: NearPairs
    edges: FeatureEdges
    edge_pairs: EdgePairs
    motion: NodeMotion
    proximity: SelfProximity
    normal: FloatArray
    """Outward normal of each node of a face, weighted by area [m2]; shape (node capacity, 3)."""
    inverted_step: IntArray
    """Value of `step` when a tetrahedron with this node was last seen inverted; shape (node
    capacity,)."""
    is_due: IntArray
    """1 if the contacts of a node are sought in this search, else 0; shape (node capacity,)."""
    resting_until: FloatArray
    """Value of `NodeMotion.quiet_path` up to which a node needs no test while neither it nor a
    corner of a face that it is paired with moves much [m], shape (node capacity,)."""
    contact: IntArray
    """First contact of each node with faces, in the list in use; shape (node capacity,)."""
    n_contacts: IntArray
    """Number of contacts of each node with faces, shape (node capacity,)."""
    listed_at: IntArray
    """Listing in which the contacts of each node with faces were last listed; shape (node
    capacity,)."""
    floor_contact: IntArray
    """Contact of each node with the floor in the list in use, shape (node capacity,)."""
    floor_listed_at: IntArray
    """Listing in which each node was last in contact with the floor, shape (node capacity,)."""
    edge_contact: IntArray
    """Scratch: last contact of feature edges that begins with each node, counted from their first;
    shape (node capacity,)."""
    edge_contact_at: IntArray
    """Search in which that was written, shape (node capacity,)."""
    recovered: FloatArray
    """Distance by which the contacts of each node came out since the last incision [m], shape (node
    capacity,)."""
    distance: FloatArray
    """Scratch: squared distance of the contacts that a node was found to have [m2], shape (3,)."""
    share: FloatArray
    """Scratch of `split_masses`, shape (node capacity,)."""
    floor: float
    """Height of the floor [m], or -inf."""


@kernel
def are_many_moving(search: SearchState) -> bool:
    """Whether so many nodes moved much that all are tested."""
    return bool(_MANY_MOVING * search.motion.n_moving > search.pairs.n_nodes)
