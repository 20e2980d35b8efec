"""`Audit`: the account of energy of a body: the work done on it, and where that went."""

from typing import Final, NamedTuple

import numpy as np

from tissue.blade.blade_state import clear_works
from tissue.blade.edge import Edge
from tissue.core.array_types import FloatArray
from tissue.core.jit import SameTypes, kernel
from tissue.core.structs import Arrays, FloatCell, IntCell
from tissue.elasticity.energy import elastic_energy, kinetic_energy, potential_energy
from tissue.forces.attachments import attached_energy
from tissue.forces.step_context import StepContext
from tissue.forces.terms import energy_of_terms
from tissue.mesh.changes import ChangedMesh
from tissue.types import N_WORKS, Energies


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
    """Change of each energy by changes of the mesh [J]. No time passes in them.

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


N_AMOUNTS = len(_Amounts._fields)
N_CHANGES = len(MeshChanges._fields)
"""Numbers of `MeshChanges`, which are of the first of `_Amounts`."""

RESIDUAL: Final = len(Energies._fields)
"""Place of the residual behind the numbers of `Energies`."""

BODY_IS_KNOWN: Final = 1
"""The energies of the body itself, the first three of `_Amounts`, are known."""
ALL_IS_KNOWN: Final = 2
"""All of `_Amounts` are known."""


class Account(Arrays):
    """The account of energy of one body."""

    is_kept: IntCell
    """1 where an account is kept; else all numbers but the works here are 0."""
    work_of_loads: FloatCell
    """Work of loads, and of what moves attachments, since the account began [J]."""
    lost_at_geoms: FloatCell
    """Energy lost in contacts with rigid geoms since the account began [J]."""
    attached_at_first: FloatCell
    """Energy in attachments when it began [J]."""
    now: FloatArray
    """The numbers of `_Amounts`, shape (`N_AMOUNTS`,)."""
    at_first: FloatArray
    """Those when the account began."""
    changes: FloatArray
    """Energy that changes of the mesh added since then: the numbers of `MeshChanges`."""
    energies: FloatArray
    """The numbers of `Energies`, and their residual."""


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
        out: Written, shape (`N_AMOUNTS`,).
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


@kernel
def attached_now(context: StepContext) -> float:
    """Return the energy in the springs of attachments [J]."""
    attachments = context.attachments
    if not len(attachments.nodes):
        return 0.0
    energy: float = attached_energy(attachments, context.body.positions, 0, len(attachments.nodes))
    return energy


@kernel
def write_energies(
    account: Account, context: StepContext, edge: Edge, when: float, known: int
) -> None:
    """Write the energies at an instant, and their residual.

    Args:
        account: Written.
        context: The body and all that acts on it.
        edge: The cutting edge over a time step.
        when: Instant of it, as a fraction.
        known: `BODY_IS_KNOWN`, `ALL_IS_KNOWN`, or 0.
    """
    now, first, out = account.now, account.at_first, account.energies
    if known != ALL_IS_KNOWN:
        _write_amounts(context, edge, when, known == BODY_IS_KNOWN, now)
    attachments, attached = context.attachments, attached_now(context) - account.attached_at_first
    in_contacts = now[5] - first[5]
    # What the body gave to contacts, and their springs do not hold.
    lost_in_contacts = (first[6] - now[6]) - in_contacts
    out[0], out[1], out[2] = now[7], account.work_of_loads, now[8]
    for i in range(3):
        out[3 + i] = now[i] - first[i]
    out[6] = now[3] + now[4] + in_contacts + attached
    out[7] = now[9] + attachments.dissipated
    out[8], out[9], out[10] = now[10], now[11] + attachments.severing, now[12]
    out[11] = account.lost_at_geoms + lost_in_contacts
    out[12] = now[13] - _sum(account.changes, 0, N_CHANGES)
    out[13] = now[14] + attachments.released
    out[RESIDUAL] = _sum(out, 0, N_WORKS) - _sum(out, N_WORKS, RESIDUAL)


@kernel
def _sum(numbers: FloatArray, begin: int, end: int) -> float:
    total = 0.0
    for i in range(begin, end):
        total += numbers[i]
    return total


class Audit:
    """The account of one body, or none.

    It costs a sum over the body in each step, and two more in each cut that changes the mesh.

    Args:
        is_kept: Whether an account is kept; if not, the methods do nothing.
    """

    def __init__(self, *, is_kept: bool) -> None:
        self.account = Account(
            is_kept=int(is_kept),
            work_of_loads=0.0,
            lost_at_geoms=0.0,
            attached_at_first=0.0,
            now=np.zeros(N_AMOUNTS),
            at_first=np.zeros(N_AMOUNTS),
            changes=np.zeros(N_CHANGES),
            energies=np.zeros(RESIDUAL + 1),
        )
        """Its numbers."""
        self.is_kept = is_kept
        """Whether an account is kept."""
        self._before_cut = np.zeros(N_CHANGES)
        self.is_known = False
        """Whether the energy is known: the body has not moved since, nor its mesh changed."""
        self._write, self._attached = SameTypes(write_energies), SameTypes(attached_now)
        self._of: tuple[Edge | None, float] = (None, 0.0)

    @property
    def changes(self) -> MeshChanges:
        """Energy that changes of the mesh added since the account began."""
        return MeshChanges(*self.account.changes.tolist())

    def begin(self, context: StepContext, edge: Edge) -> None:
        """Begin the account with the body as it is; work and losses so far are forgotten."""
        if not self.is_kept:
            return
        account, attachments = self.account, context.attachments
        context.damping.is_counted = 1
        context.damping.dissipated = account.lost_at_geoms = 0.0
        account.changes[:] = 0.0
        clear_works(context.blade.totals)
        context.supports.work = account.work_of_loads = 0.0
        context.elastic.scaling.lost = 0.0
        attachments.dissipated = attachments.severing = attachments.released = 0.0
        account.attached_at_first = self._attached.call(context)
        self.forget()
        self.update(context, edge, 1.0)
        account.at_first[:] = account.now

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
        if self.is_kept:
            self.update(context, edge, when)
            self._before_cut[:] = self.account.now[:N_CHANGES]

    def after_cut(self, context: StepContext, edge: Edge, when: float) -> None:
        """Count the energy that the change of the mesh took; where it has not changed, none."""
        if self.is_kept and not self.is_known:
            self.update(context, edge, when)
            changes = self.account.changes
            changes[:] = changes + self.account.now[:N_CHANGES] - self._before_cut

    def update(self, context: StepContext, edge: Edge, when: float) -> None:
        """Write the energies at an instant, and their residual."""
        self._write.call(self.account, context, edge, when, self.take(edge, when))

    def take(self, edge: Edge, when: float) -> int:
        """Note that the energies will be known at an instant; return what of them is known.

        What is known is remembered until the body moves or its mesh changes.
        """
        known = BODY_IS_KNOWN if self.is_known else 0
        if self.is_known and self._of == (edge, when):
            known = ALL_IS_KNOWN
        self.is_known, self._of = True, (edge, when)
        return known
