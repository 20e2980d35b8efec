"""`PenaltyContact`: owns the arrays of contact by forces, and searches once in a time step.

Contacts are found before the substeps, with what nodes do in the meantime allowed for, and act as
springs in every evaluation of the forces. Their stiffness is bounded by the masses of their nodes,
so that contact hardly shortens the stable step.
"""

import numpy as np

from tissue.contact.faces import (
    Faces,
    grown_faces,
    new_faces,
    update_changed_faces,
    with_found_pieces,
    with_room,
)
from tissue.contact.node_normals import update_normals
from tissue.contact.penalty.contact_forces import (
    clear_contact_totals,
    end_contact_substep,
    grown_penalty_forces,
    new_penalty_forces,
)
from tissue.contact.penalty.contact_list import (
    DIRECTIONS,
    find_due,
    floor_changes,
    list_contacts,
)
from tissue.contact.penalty.lost_nodes import look_for_lost_node
from tissue.contact.penalty.near_pairs import grown_near_pairs, new_near_pairs
from tissue.contact.penalty.node_ways import (
    IN_BALL,
    LOST,
    grown_node_ways,
    measure_ways,
    new_node_ways,
    note_places,
)
from tissue.contact.penalty.pair_update import SKIN_WAY, update_pairs
from tissue.contact.penalty.search_state import SearchState
from tissue.contact.penalty.stiffness import new_limits, recover, split_masses
from tissue.core.array_types import FloatArray
from tissue.core.simd import room_for_points
from tissue.mesh.body import Body, grown
from tissue.mesh.changes import Change
from tissue.types import BodyContacts

ADDED_SHARE = 0.55
"""What contact may add to w^2 of a node, as a share of the bound of the body before any cut.
Larger: stiffer contact and shorter steps; smaller: what is pressed sinks in."""

LEAST_ADDED = 5e6
"""What contact may add at least [1/s2], to a body that is soft or coarse: its steps are long, two
in a millisecond with contact. Smaller: what lies on such a body sinks into it by its weight."""

RETARDATION_TIME = 0.45
"""Damping per stiffness of contacts, over the square root of what they may add to w^2: 1e-4 s in an
organ of liver. Larger: shorter steps; smaller: what meets bounces and trembles for longer."""

_SEARCHES_TO_NORMALS = 8
"""Searches after which normals are computed anew where no pair is updated."""

_SEARCHES_TO_NEW_FACES = 4
"""Searches after which faces that a cut made are paired. Those that are gone still have their
nodes, so that what they hold meanwhile keeps its momentum."""

CAPACITY_OF_PAIRS = 1 << 12
"""Pairs that there is room for at first."""


class PenaltyContact:
    """Contact of one body with itself and with the floor, as forces.

    Args:
        body: Body at its start.
        node_size: Mean node size of the body [m].
        friction: Coefficient of friction.
        floor: Height of the floor [m], or None.
        frequency_squared: Bound on w^2 of the body before any cut [1/s2].
    """

    def __init__(
        self,
        body: Body,
        node_size: float,
        friction: float,
        floor: float | None,
        frequency_squared: float,
    ) -> None:
        n_nodes = len(body.rest)
        added = max(ADDED_SHARE * frequency_squared, LEAST_ADDED)
        faces = new_faces(len(body.tetrahedra))
        of_nodes = ("inverted_step", "is_due", "contact", "n_contacts", "listed_at")
        self._search = SearchState(
            step=0,
            turn=0,
            n_listings=1,
            faces=faces,
            pairs=new_near_pairs(n_nodes, len(faces.face), CAPACITY_OF_PAIRS),
            ways=new_node_ways(n_nodes, node_size),
            limits=new_limits(node_size, added),
            normal=room_for_points(n_nodes),
            **{name: np.zeros(n_nodes, np.int64) for name in of_nodes},
            calm_until=np.zeros(n_nodes),
            floor_contact=np.zeros(n_nodes, np.int64),
            floor_listed_at=np.zeros(n_nodes, np.int64),
            distance=np.zeros(DIRECTIONS),
            share=np.zeros(n_nodes),
            floor=-np.inf if floor is None else float(floor),
        )
        time = RETARDATION_TIME / np.sqrt(added)
        self.forces = new_penalty_forces(n_nodes, friction, time)
        self._is_awake = floor is not None
        self._is_searched = False
        self._is_pairing_due = True
        self._has_new_faces = False
        self._is_listing_due = True
        self._since_pairing = 0
        self._since_normals = _SEARCHES_TO_NORMALS
        self._find_pieces(body)

    @property
    def is_awake(self) -> bool:
        """Whether there is anything that could touch."""
        return self._is_awake

    @property
    def added_frequency_squared(self) -> float:
        """What contact adds at most to w^2 of the body [1/s2]."""
        return self._search.limits.added if self.forces.n_contacts else 0.0

    def begin(self) -> None:
        """Clear the totals, and search before the next substep."""
        clear_contact_totals(self.forces)
        self._is_searched = False

    def report(self, dt: float) -> BodyContacts:
        """Return the contacts since `begin`; `dt` is the time that has passed [s]."""
        forces = self.forces
        per_second = 1.0 / dt if dt > 0.0 else 0.0
        return BodyContacts(
            n_contacts=forces.n_pressing,
            penetration=forces.penetration,
            force=forces.pressure_impulse * per_second,
            force_of_floor=forces.floor_impulse * per_second,
        )

    def prepare(
        self, body: Body, frequency_squared: FloatArray, highest: float, seconds: float
    ) -> None:
        """Find the contacts of a time step, unless this was done since `begin`.

        Args:
            body: Where the nodes are.
            frequency_squared: Bound on w^2 of each node without contact [1/s2].
            highest: Bound on w^2 of the body without contact [1/s2].
            seconds: Length of the time step [s].
        """
        if self._is_searched or not self._is_awake:
            return
        self._is_searched = True
        search, pairs = self._search, self._search.pairs
        where = measure_ways(search.ways, body, pairs.nodes, pairs.n_nodes)
        if where == LOST:
            self.forces.n_contacts = 0
            search.n_listings += 1
            self._is_pairing_due = True
            return
        is_anew = self._needs_pairing(where != IN_BALL)
        self._update_normals(body, is_anew)
        if is_anew:
            self._update_pairs(body)
        n_due = find_due(self._search, is_anew)
        if n_due or self._is_listing_due or floor_changes(self._search, body):
            self._list(body, frequency_squared, highest)
        look_for_lost_node(self._search, body)
        recover(self.forces, self._search.limits, body, seconds)
        note_places(self._search.ways, body)

    def end_substep(self, body: Body, external: FloatArray, seconds: float) -> None:
        """Let what slides slide on after a substep, and clear the forces [N] on the nodes."""
        end_contact_substep(self.forces, body.positions, body.velocities, external)

    def start_substep(self, body: Body) -> None:
        """Do nothing: contact depends on no position before a substep."""

    def mesh_changed(self, body: Body, change: Change) -> None:
        """Add the faces that a pass of a cut made.

        The lips of the first incision do not touch before it ends: the blade is between them.
        """
        faces = with_room(self._search.faces, 4 * change.n_dirty)
        update_changed_faces(faces, body, change)
        self._take_faces(faces)
        self._has_new_faces = self._is_listing_due = True
        self._is_searched = False

    def incision_ended(self, body: Body) -> None:
        """Let the lips of the incision touch; where the body is in pieces now, their skin too."""
        self._is_awake = self._is_awake or self._search.faces.n_places > 0
        self._find_pieces(body)

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Make room for a body of `n_nodes` and `n_tetrahedra`."""
        search = self._search
        of_nodes = ("inverted_step", "is_due", "contact", "n_contacts", "listed_at", "calm_until")
        others = ("floor_contact", "floor_listed_at", "share", "normal")
        self._search = search.replaced(
            faces=grown_faces(search.faces, n_tetrahedra),
            pairs=grown_near_pairs(search.pairs, n_nodes),
            ways=grown_node_ways(search.ways, n_nodes),
            **{name: grown(getattr(search, name), n_nodes) for name in (*of_nodes, *others)},
        )

    def _find_pieces(self, body: Body) -> None:
        """Find out whether the body is in pieces; their skin may touch then, too."""
        faces = with_found_pieces(self._search.faces, body)
        if faces is not None:
            self._take_faces(faces)
            self._is_awake = self._is_pairing_due = True
            self._search.ways.largest_way = np.inf

    def _take_faces(self, faces: Faces) -> None:
        """Take these faces, which may be in other arrays than before."""
        if faces is not self._search.faces:
            self._search = self._search.replaced(faces=faces)

    def _needs_pairing(self, has_left: bool) -> bool:
        """Whether pairs are out of date; `has_left`: a node has left its ball."""
        self._since_pairing += 1
        is_old = self._has_new_faces and self._since_pairing >= _SEARCHES_TO_NEW_FACES
        ways = self._search.ways
        has_skin_moved = (
            self._search.faces.has_skin and ways.largest_way > SKIN_WAY * ways.node_size
        )
        return bool(has_left or is_old or has_skin_moved or self._is_pairing_due)

    def _update_normals(self, body: Body, is_anew: bool) -> None:
        """Compute the normals of nodes, now and then."""
        self._since_normals += 1
        if is_anew or self._since_normals >= _SEARCHES_TO_NORMALS:
            search = self._search
            search.step += 1
            update_normals(search.faces, body, search.normal, search.inverted_step, search.step)
            self._since_normals = 0

    def _update_pairs(self, body: Body) -> None:
        """Pair what left its ball or changed, with room as needed."""
        while True:
            search = self._search
            if update_pairs(search.pairs, search.ways, search.faces, body, search.normal):
                break
            room = len(search.pairs.wake)
            n_faces = max(len(search.faces.face), len(search.pairs.triangle))
            self._search = search.replaced(pairs=new_near_pairs(len(search.share), n_faces, room))
        self._since_pairing = 0
        self._is_pairing_due = self._has_new_faces = False
        self._is_listing_due = True

    def _list(self, body: Body, frequency_squared: FloatArray, highest: float) -> None:
        """List the contacts, with room as needed, and find how stiff they may be."""
        search = self._search
        has_floor = np.isfinite(search.floor)
        needed = DIRECTIONS * search.pairs.n_nodes + (body.n_nodes if has_floor else 0)
        if needed > len(self.forces.push) // 2:
            self._move_contacts(2 * needed)
        list_contacts(search, self.forces, body)
        search.limits.highest = highest
        split_masses(self.forces, search.limits, body, frequency_squared, search.share)
        self._is_listing_due = False

    def _move_contacts(self, capacity: int) -> None:
        """Move the contacts to arrays with room for that many."""
        search, first = self._search, self.forces.first
        self.forces = grown_penalty_forces(self.forces, capacity)
        search.contact[:] -= first
        search.floor_contact[:] -= first
