"""`SelfContact`: owns the arrays of contact by forces, and searches once in a time step.

Contacts are found before the substeps, with what nodes do in the meantime allowed for, and act as
springs in every evaluation of the forces. Their stiffness is bounded by the masses of their nodes,
so that contact barely shortens the stable step.
"""

import numpy as np

from tissue.contact.geometry.faces import (
    Faces,
    grown_faces,
    new_faces,
    with_found_pieces,
    with_room,
    with_skin,
)
from tissue.contact.narrow.contact_list import DIRECTIONS
from tissue.contact.response.contacts import grown_penalty_forces, new_penalty_forces
from tissue.contact.response.stiffness import new_limits
from tissue.contact.search.edge_pairs import NOT_LISTED, new_edge_pairs
from tissue.contact.search.feature_edges import new_feature_edges
from tissue.contact.search.near_pairs import grown_near_pairs, new_near_pairs
from tissue.contact.search.node_motion import grown_node_motion, new_node_motion
from tissue.contact.search.search_state import SearchState
from tissue.contact.search.self_proximity import grown_self_proximity, new_self_proximity
from tissue.contact.search_stages import (
    BEGIN,
    DONE,
    NEEDS_SKIN,
    NO_ROOM_FOR_PAIRS,
    SEARCHES_TO_NORMALS,
    added_frequency,
    begin_contacts,
    search_contacts,
    take_changed_faces,
    wake_contacts,
)
from tissue.core.array_types import FloatArray
from tissue.core.jit import SameTypes
from tissue.core.simd import room_for_points
from tissue.mesh.body import Body, grown
from tissue.mesh.changes import ChangedMesh
from tissue.types import BodyContacts

ADDED_SHARE = 0.55
"""Part of contact in w^2 of a node, as a share of the bound of the body before any cut.
Larger: stiffer contact and shorter steps; smaller: what is pressed sinks in."""

LEAST_ADDED = 9e6
"""Least part of contact [1/s2], to a body that is soft or coarse: its steps are long, two
in a millisecond with contact. Smaller: what lies on such a body sinks into it by its weight."""

RETARDATION_TIME = 0.45
"""Damping per stiffness of contacts, over the square root of what they may add to w^2: 1e-4 s in an
organ of liver. Larger: shorter steps; smaller: what meets bounces and trembles for longer."""

CAPACITY_OF_PAIRS = 1 << 12
"""Pairs that there is room for at first."""


_TAKE_CHANGED = SameTypes(take_changed_faces)

_NO_FORCE = np.zeros(3)
_NO_FORCE.setflags(write=False)  # many results share it
_NOTHING_TOUCHES = BodyContacts(0, 0.0, 0.0, _NO_FORCE)


class SelfContact:
    """Contact of one body with itself and with the floor, as forces.

    Args:
        body: Body at its start.
        node_size: Mean node size of the body [m].
        friction: Coefficient of friction.
        floor: Height of the floor [m], or None.
        frequency_squared: Bound on w^2 of the body before any cut [1/s2].
        acts: Whether there is contact; if not, nothing ever touches.
        adds_mass: Whether nodes in contact may get mass.
    """

    def __init__(
        self,
        body: Body,
        node_size: float,
        friction: float,
        floor: float | None,
        frequency_squared: float,
        *,
        acts: bool = True,
        adds_mass: bool = False,
    ) -> None:
        n_nodes = len(body.rest)
        faces = new_faces(len(body.tetrahedra))
        of_nodes = ("inverted_step", "is_due", "contact", "n_contacts", "listed_at")
        self.search = SearchState(
            step=0,
            turn=0,
            n_rounds=1,
            n_listings=1,
            stage=BEGIN,
            is_pairing=0,
            is_pairing_due=1,
            has_new_faces=0,
            is_listing_due=1,
            since_pairing=0,
            since_normals=SEARCHES_TO_NORMALS,
            n_due=0,
            acts=int(acts),
            is_awake=0,
            is_tested=0,
            is_searched=0,
            has_touched=0,
            n_found=0,
            all_resting_until=0.0,
            faces=faces,
            pairs=new_near_pairs(n_nodes, len(faces.face), CAPACITY_OF_PAIRS),
            edges=new_feature_edges(len(faces.face)),
            edge_pairs=new_edge_pairs(CAPACITY_OF_PAIRS),
            motion=new_node_motion(n_nodes, node_size),
            proximity=new_self_proximity(n_nodes),
            normal=room_for_points(n_nodes),
            **{name: np.zeros(n_nodes, np.int64) for name in of_nodes},
            resting_until=np.zeros(n_nodes),
            floor_contact=np.zeros(n_nodes, np.int64),
            floor_listed_at=np.zeros(n_nodes, np.int64),
            edge_contact=np.zeros(n_nodes, np.int64),
            edge_contact_at=np.zeros(n_nodes, np.int64),
            recovered=np.zeros(n_nodes),
            distance=np.zeros(DIRECTIONS),
            share=np.zeros(n_nodes),
            floor=-np.inf if floor is None else float(floor),
        )
        """Data of the search; another struct where its arrays grow."""
        self.forces = new_penalty_forces(n_nodes, friction, 0.0)
        self._node_size, self._adds_mass = node_size, adds_mass
        self.take_frequency(frequency_squared)
        self._search_contacts = SameTypes(search_contacts)
        self._find_pieces(body)

    def take_friction(self, friction: float) -> None:
        """Take the coefficient of a body that has one; of others it comes with the next list."""
        self.forces.friction[:] = friction
        self.search.is_listing_due = 1

    def take_frequency(self, frequency_squared: float) -> None:
        """Set stiffness and damping for a body of that bound on w^2 before any cut [1/s2]."""
        added = max(ADDED_SHARE * frequency_squared, LEAST_ADDED)
        self.limits = new_limits(self._node_size, added, adds_mass=self._adds_mass)
        """Limits of the stiffness and the recovery of contacts."""
        time = float(RETARDATION_TIME / np.sqrt(added))
        self.forces.damping_time[:] = time
        self.forces = self.forces.replaced(retardation_time=time)

    @property
    def is_touching(self) -> bool:
        """Whether there are contacts; some are kept ready."""
        return self.search.n_found > 0

    @property
    def added_frequency_squared(self) -> float:
        """Largest part of contact in w^2 of the body [1/s2]."""
        return added_frequency(self.search, self.limits)

    def begin(self) -> None:
        """Clear the totals, and search before the next substep."""
        begin_contacts(self.search, self.forces)

    def report(self, dt: float) -> BodyContacts:
        """Return the contacts since `begin`; `dt` is the time that has passed [s]."""
        if not self.search.has_touched:
            return _NOTHING_TOUCHES
        forces = self.forces
        per_second = 1.0 / dt if dt > 0.0 else 0.0
        has_floor = self.search.floor > -np.inf
        return BodyContacts(
            n_contacts=forces.n_pressing,
            penetration=forces.penetration,
            force=forces.pressure_impulse * per_second,
            force_of_floor=forces.floor_impulse * per_second if has_floor else _NO_FORCE,
        )

    def prepare(
        self,
        body: Body,
        frequency_squared: FloatArray,
        highest: float,
        room: float,
        seconds: float,
    ) -> None:
        """Find the contacts of a time step, unless this was done since `begin`.

        Args:
            body: Where the nodes are.
            frequency_squared: Bound on w^2 of each node without contact [1/s2].
            highest: Bound on w^2 of the body without contact [1/s2].
            room: What may be added to that without another step [1/s2].
            seconds: Length of the time step [s].
        """
        while True:
            outcome = wake_contacts(self.search, body)
            if outcome == DONE:
                return
            self.follow_up(outcome, body, frequency_squared, highest, room, seconds)

    def follow_up(
        self,
        outcome: int,
        body: Body,
        frequency_squared: FloatArray,
        highest: float,
        room: float,
        seconds: float,
    ) -> None:
        """Search the contacts, or take the skin, that a test of what could touch found due.

        Args:
            outcome: Returned by `wake_contacts`; not DONE.
            body: Where the nodes are.
            frequency_squared: Bound on w^2 of each node without contact [1/s2].
            highest: Bound on w^2 of the body without contact [1/s2].
            room: What may be added to that without another step [1/s2].
            seconds: Length of the time step [s].
        """
        if outcome == NEEDS_SKIN:
            self._take_skin(with_skin(self.search.faces, body))
            return
        while True:
            of_contact = self.search, self.forces, self.limits
            bounds = highest, room, seconds
            found = self._search_contacts.call(*of_contact, body, frequency_squared, *bounds)
            if found == DONE:
                return
            if found == NO_ROOM_FOR_PAIRS:
                self._double_room_for_pairs()
            else:
                self._make_room_for_contacts(body)

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Add the faces that a pass of a cut made: lips touch as soon as they have parted."""
        if not self.search.acts:
            return
        while not _TAKE_CHANGED.call(self.search, changed.body, changed.change):
            self._take_faces(with_room(self.search.faces, 4 * changed.change.n_dirty))

    def incision_ended(self, body: Body) -> None:
        """Add the skin of pieces, where the body is in pieces now."""
        self.search.recovered[:] = 0.0
        self._find_pieces(body)

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for a body of `n_nodes` and `n_tetrahedra`."""
        search = self.search
        of_nodes = (
            "inverted_step",
            "is_due",
            "contact",
            "n_contacts",
            "listed_at",
            "resting_until",
        )
        of_floor = ("floor_contact", "floor_listed_at")
        of_edges = ("edge_contact", "edge_contact_at")
        others = (*of_floor, *of_edges, "recovered", "share", "normal")
        self.search = search.replaced(
            faces=grown_faces(search.faces, n_tetrahedra),
            pairs=grown_near_pairs(search.pairs, n_nodes),
            motion=grown_node_motion(search.motion, n_nodes),
            proximity=grown_self_proximity(search.proximity, n_nodes),
            **{name: grown(getattr(search, name), n_nodes) for name in (*of_nodes, *others)},
        )

    def _find_pieces(self, body: Body) -> None:
        """Find out whether the body is in pieces; their skin may touch then, too."""
        if not self.search.acts:
            return
        faces = with_found_pieces(self.search.faces, body)
        if faces is not None:
            self._take_skin(faces)

    def _take_skin(self, faces: Faces) -> None:
        """Take faces with skin among them; what may touch is tested again."""
        self._take_faces(faces)
        self.search.is_awake = 1
        self.search.is_pairing_due = 1
        self.search.motion.largest_path = np.inf

    def _take_faces(self, faces: Faces) -> None:
        """Take these faces, which may be in other arrays than before."""
        if faces is not self.search.faces:
            self.search = self.search.replaced(faces=faces)

    def _double_room_for_pairs(self) -> None:
        """Make room for twice as many pairs, and for all faces; all is paired again."""
        search = self.search
        room = len(search.pairs.wake)
        n_faces = max(len(search.faces.face), len(search.pairs.triangle))
        n_edges = len(search.edges.is_feature)
        edge_pairs = new_edge_pairs(2 * len(search.edge_pairs.wake))
        edge_pairs.first = search.edge_pairs.first
        edge_pairs.n_contacts = search.edge_pairs.n_contacts
        self.search = search.replaced(
            pairs=new_near_pairs(len(search.share), n_faces, room),
            edges=new_feature_edges(max(n_faces, n_edges // 3)),
            edge_pairs=edge_pairs,
        )

    def _make_room_for_contacts(self, body: Body) -> None:
        """Make room for twice as many contacts as there may be."""
        search, first = self.search, self.forces.first
        on_floor = body.n_nodes if np.isfinite(search.floor) else 0
        edges = search.edge_pairs
        n_new = DIRECTIONS * search.pairs.n_nodes + on_floor + edges.n_touching
        capacity = 2 * (n_new + self.forces.n_contacts)
        self.forces = grown_penalty_forces(self.forces, capacity)
        search.contact[:] -= first
        search.floor_contact[:] -= first
        edges.first -= first
        edges.contact[edges.contact != NOT_LISTED] -= first
