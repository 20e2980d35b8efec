"""`Audit`: the account of energy of a body: the work done on it, and where that went."""

from tissue.blade.edge import Edge
from tissue.blade.forces import edge_energy
from tissue.blade.impulse_totals import clear_works
from tissue.blade.side_contact import sides_energy
from tissue.contact.penalty.contact_forces import PenaltyForces
from tissue.core.vec3 import Vec3
from tissue.elasticity.energy import kinetic_energy, potential_energy
from tissue.elasticity.internal_forces import elastic_energy
from tissue.integrators.system import System
from tissue.types import Energies


class Audit:
    """The account of one body, or none.

    It costs a sum over the body in each step, two more in each cut that changes the mesh, and two
    in each substep in which parts of the body touch.

    Args:
        gravity: Acceleration of free fall [m/s2].
        is_kept: Whether an account is kept; if not, the methods do nothing.
    """

    def __init__(self, gravity: Vec3, *, is_kept: bool) -> None:
        self._is_kept = is_kept
        self._gravity = gravity
        self._topology = self._before_cut = 0.0
        self.work_of_loads = 0.0
        """Work of the loads since the account began [J]."""
        self._now: tuple[float, float, float] | None = None
        self._at_first = (0.0, 0.0, 0.0)
        self._contacts_at_first = (0.0, 0.0)

    def begin(self, system: System) -> None:
        """Begin the account with the body as it is; work and losses so far are forgotten."""
        if not self._is_kept:
            return
        system.contact_loss.is_counted = 1
        system.damping.dissipated = system.contact_loss.dissipated = self._topology = 0.0
        clear_works(system.interaction.state.totals)
        system.supports.work = self.work_of_loads = 0.0
        system.elasticity.arrays.scaling.lost = 0.0
        self._at_first = self._stored(system)
        contacts = system.contact.forces
        self._contacts_at_first = (contacts.work, contacts.stored)

    def forget(self) -> None:
        """Forget the energy: the body moved, or its mesh changed."""
        self._now = None

    def before_cut(self, system: System, edge: Edge, when: float) -> None:
        """Note the energy before the mesh changes."""
        if self._is_kept:
            self._before_cut = self._all(system, edge, when)

    def after_cut(self, system: System, edge: Edge, when: float) -> None:
        """Count the energy that the change of the mesh took; where it has not changed, none."""
        if self._is_kept and self._now is None:
            self._topology += self._before_cut - self._all(system, edge, when)

    def energies(self, system: System, edge: Edge) -> Energies | None:
        """Return the account at the end of a step; None where none is kept."""
        if not self._is_kept:
            return None
        blade = system.interaction.state
        totals = blade.totals
        elastic, kinetic, potential = self._now or self._stored(system)
        elastic_first, kinetic_first, potential_first = self._at_first
        held = edge_energy(blade, system.body, edge, 1.0)
        contacts = system.contact.forces
        return Energies(
            work_of_blade=totals.work_of_blade,
            work_of_loads=self.work_of_loads,
            work_of_supports=system.supports.work,
            elastic=elastic - elastic_first,
            kinetic=kinetic - kinetic_first,
            potential=potential - potential_first,
            held=held + sides_energy(blade.sides) + contacts.stored - self._contacts_at_first[1],
            damping=system.damping.dissipated,
            cutting=totals.work_of_cutting,
            breaking=totals.work_of_breaking,
            friction=totals.work_of_friction,
            contact=system.contact_loss.dissipated + self._lost_in(contacts),
            topology=self._topology + system.elasticity.arrays.scaling.lost,
            released=totals.released,
        )

    def _lost_in(self, contacts: PenaltyForces) -> float:
        """Return what the body gave to contacts and their springs do not hold [J]."""
        work, stored = self._contacts_at_first
        return (work - contacts.work) - (contacts.stored - stored)

    def _stored(self, system: System) -> tuple[float, float, float]:
        """Return the elastic, kinetic and potential energy [J], and remember them."""
        body, potential = system.body, potential_energy(system.body, self._gravity)
        elastic = elastic_energy(system.elasticity.arrays, body)
        self._now = (elastic, kinetic_energy(body), potential)
        return self._now

    def _all(self, system: System, edge: Edge, when: float) -> float:
        """Return the energy of the body and of the anchors [J]."""
        stored = sum(self._now or self._stored(system))
        return stored + edge_energy(system.interaction.state, system.body, edge, when)
