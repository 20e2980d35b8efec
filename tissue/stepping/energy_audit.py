"""`Audit`: the account of energy of a body: the work done on it, and where that went."""

from typing import NamedTuple

import numpy as np

from tissue.blade.blade_state import clear_works
from tissue.blade.edge import Edge
from tissue.core.array_types import FloatArray
from tissue.core.jit import SameTypes, kernel
from tissue.elasticity.energy import elastic_energy, kinetic_energy, potential_energy
from tissue.forces.attachments import attached_energy
from tissue.forces.step_context import StepContext
from tissue.forces.terms import energy_of_terms
from tissue.mesh.changes import ChangedMesh
from tissue.types import Energies


class _Amounts(NamedTuple):
    """Energies, works and losses of a body since it was made, or since its account began [J]."""

    elastic: float
    """Elastic energy of the body."""
    kinetic: float
    """Its kinetic energy."""
    potential: float
    """Its energy in gravity."""
    edge: float
    """Energy in the anchors of the edge and the blunt sides of the blade."""
    sides: float
    """Energy between the side faces of the blade and the body."""
    in_contacts: float
    """Energy in contacts that act as springs."""
    work_of_contacts: float
    """Work of contacts that act as forces on the body."""
    work_of_blade: float
    """Work of the blade."""
    work_of_supports: float
    """Work of fixed nodes that are moved."""
    damping: float
    """Energy that damping took."""
    cutting: float
    """Energy that cutting took."""
    breaking: float
    """Energy that breaking the skin took."""
    friction: float
    """Energy that friction on the blade took."""
    mass: float
    """Energy that nodes lost when they got mass."""
    released: float
    """Energy of contacts with the blade that ended."""


class MeshChanges(NamedTuple):
    """What changes of the mesh added to each energy [J]. No time passes in them.

    Tests bound each in sign and size (`tests/system/energy/test_energy_account.py`).
    """

    elastic: float = 0.0
    """Elastic energy: finer tetrahedra, or springs, resist the same strain by more."""
    kinetic: float = 0.0
    """Kinetic energy, which nodes lose that are put on edges and that part."""
    potential: float = 0.0
    """Energy in gravity; rounding alone."""
    edge: float = 0.0
    """Energy of anchors whose tetrahedron was divided."""


@kernel
def _write_amounts(
    context: StepContext, edge: Edge, when: float, is_known: bool, out: FloatArray
) -> None:
    """Write the numbers of `_Amounts`.

    Args:
        context: The body and all that acts on it.
        edge: The cutting edge over a time step.
        when: Instant of it, as a fraction.
        is_known: Whether the energies of the body itself, the first three, are known.
        out: Written, shape (15,).
    """
    body, elastic, blade = context.body, context.elastic, context.blade
    if not is_known:
        out[0] = elastic_energy(elastic, body)
        out[1] = kinetic_energy(body)
        out[2] = potential_energy(body, context.surroundings.gravity)
    totals, contacts = blade.totals, context.contacts
    stored = energy_of_terms(context, edge, when)
    out[3], out[4] = stored.edge, stored.sides
    out[5], out[6] = stored.contacts, contacts.work
    out[7], out[8] = totals.work_of_blade, context.supports.work
    out[9], out[10] = context.damping.dissipated, totals.work_of_cutting
    out[11], out[12] = totals.work_of_breaking, totals.work_of_friction
    out[13], out[14] = elastic.scaling.lost, totals.released


def _attached(context: StepContext) -> float:
    """Return the energy in the springs of attachments [J]."""
    attachments = context.attachments
    if not len(attachments.nodes):
        return 0.0
    return attached_energy(attachments, context.body.positions, 0, len(attachments.nodes))


class Audit:
    """The account of one body, or none.

    It costs a sum over the body in each step, and two more in each cut that changes the mesh.

    Args:
        is_kept: Whether an account is kept; if not, the methods do nothing.
    """

    def __init__(self, *, is_kept: bool) -> None:
        self._is_kept = is_kept
        self.changes = MeshChanges()
        """What changes of the mesh added since the account began."""
        self._before_cut = self.changes
        self.work_of_loads = 0.0
        """Work of loads, and of what moves attachments, since the account began [J]."""
        self.lost_at_geoms = 0.0
        """Energy lost in contacts with rigid geoms since the account began [J]."""
        self._attached_at_first = 0.0
        self.is_known = False
        """Whether the energy is known: the body has not moved since, nor its mesh changed."""
        self._numbers = np.zeros(len(_Amounts._fields))
        self._now = self._at_first = _Amounts(*self._numbers)
        self._write = SameTypes(_write_amounts)
        self._of: tuple[Edge | None, float] = (None, 0.0)

    def begin(self, context: StepContext, edge: Edge) -> None:
        """Begin the account with the body as it is; work and losses so far are forgotten."""
        if not self._is_kept:
            return
        context.damping.is_counted = 1
        context.damping.dissipated = self.lost_at_geoms = 0.0
        self.changes = MeshChanges()
        clear_works(context.blade.totals)
        context.supports.work = self.work_of_loads = 0.0
        context.elastic.scaling.lost = 0.0
        attachments = context.attachments
        attachments.dissipated = attachments.severing = attachments.released = 0.0
        self._attached_at_first = _attached(context)
        self.forget()
        self._at_first = self._amounts(context, edge, 1.0)

    def forget(self) -> None:
        """Forget the energy: the body moved, or its mesh changed."""
        self.is_known = False

    def mesh_changed(self, changed: ChangedMesh) -> None:
        """Forget the energy; what the change took is counted after the cut."""
        del changed
        self.forget()

    def grow(self, n_nodes: int, n_tetrahedra: int) -> None:
        """Do nothing: there are no rows of nodes."""

    def before_cut(self, context: StepContext, edge: Edge, when: float) -> None:
        """Note the energy before the mesh changes."""
        if self._is_kept:
            self._before_cut = self._parts(context, edge, when)

    def after_cut(self, context: StepContext, edge: Edge, when: float) -> None:
        """Count the energy that the change of the mesh took; where it has not changed, none."""
        if self._is_kept and not self.is_known:
            parts = zip(
                self.changes, self._before_cut, self._parts(context, edge, when), strict=True
            )
            self.changes = MeshChanges(*(sum_ + after - before for sum_, before, after in parts))

    def energies(self, context: StepContext, edge: Edge) -> Energies | None:
        """Return the account at the end of a step; None where none is kept."""
        if not self._is_kept:
            return None
        now, first = self._amounts(context, edge, 1.0), self._at_first
        attachments, attached = context.attachments, _attached(context) - self._attached_at_first
        in_contacts = now.in_contacts - first.in_contacts
        # What the body gave to contacts, and their springs do not hold.
        lost_in_contacts = (first.work_of_contacts - now.work_of_contacts) - in_contacts
        return Energies(
            work_of_blade=now.work_of_blade,
            work_of_loads=self.work_of_loads,
            work_of_supports=now.work_of_supports,
            elastic=now.elastic - first.elastic,
            kinetic=now.kinetic - first.kinetic,
            potential=now.potential - first.potential,
            held=now.edge + now.sides + in_contacts + attached,
            damping=now.damping + attachments.dissipated,
            cutting=now.cutting,
            breaking=now.breaking + attachments.severing,
            friction=now.friction,
            contact=self.lost_at_geoms + lost_in_contacts,
            topology=now.mass - sum(self.changes),
            released=now.released + attachments.released,
        )

    def _amounts(self, context: StepContext, edge: Edge, when: float) -> _Amounts:
        """Return the amounts now; they are remembered until the body moves or its mesh changes."""
        if not (self.is_known and self._of == (edge, when)):
            self._write.call(context, edge, when, self.is_known, self._numbers)
            self._now, self._of = _Amounts(*self._numbers.tolist()), (edge, when)
            self.is_known = True
        return self._now

    def _parts(self, context: StepContext, edge: Edge, when: float) -> MeshChanges:
        """Return the energies of the body and of the anchors [J]."""
        now = self._amounts(context, edge, when)
        return MeshChanges(now.elastic, now.kinetic, now.potential, now.edge)
