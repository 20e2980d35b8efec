"""`LazyResult`: the result of a step, most fields of which are made on first use."""

from operator import attrgetter
from typing import Self

import numpy as np

from tissue.blade.wrench import ADDED, AMOUNTS, BOUNDS, STIFFNESS, WrenchReport
from tissue.contact.geoms.geom_contact import GeomContact
from tissue.core.array_types import FloatArray
from tissue.core.lazy_fields import lazy_fields
from tissue.core.three_vectors import Wrench
from tissue.types import (
    AddedMass,
    BodyContacts,
    BoxNumbers,
    Energies,
    RigidContacts,
    StageTimes,
    StepResult,
)


@lazy_fields(
    wrench_t1=lambda result: result.wrench_at_end(),
    stiffness=lambda result: result.numbers[STIFFNESS].reshape(6, 6),
    contacts=lambda result: result.all_contacts(),
    force_on_tissue=lambda result: result.numbers[15:18].copy(),
    bounds=lambda result: result.numbers[BOUNDS].reshape(2, 3),
    added_mass=lambda result: AddedMass.of_numbers(result.numbers[ADDED]),
    energies=lambda result: result.energies_of_account(),
    cutting_of_labels=lambda result: result.of_labels(0),
    force_of_labels=lambda result: result.of_labels(1),
)
class LazyResult(StepResult):
    """The result of a step, with a copy of what the blade reported."""

    numbers: FloatArray
    """Copy of `WrenchReport.plain`."""
    of_blade: RigidContacts
    geoms: GeomContact | None
    terms: FloatArray | None
    corners: BoxNumbers
    contacts_of_blade = property(attrgetter("of_blade"))
    numbers_at_end = property(lambda result: result.numbers[STIFFNESS.start : ADDED.stop])
    account = property(attrgetter("terms"))
    box = property(attrgetter("corners"))
    has_views = True
    """Contacts are views of the report of the blade."""

    @classmethod
    def of(
        cls,
        report: WrenchReport,
        contacts: RigidContacts,
        geoms: GeomContact | None,
        account: FloatArray | None,
        has_blade: bool,
        of_cut: tuple[int, float, float],
        of_step: tuple[int, BodyContacts, StageTimes],
    ) -> Self:
        """Return the result of a step.

        Args:
            report: That of the blade.
            contacts: Its contacts.
            geoms: Contact with geoms, where there is any.
            account: `StepResult.account`, which is kept.
            has_blade: Whether there is a blade.
            of_cut: Number of active tetrahedra, area, and finished area.
            of_step: From `n_substeps` on, but for the energies.
        """
        numbers = report.plain.copy()
        plain = numbers[: BOUNDS.stop].tolist()
        a, b, c, d, e, f, g, h, i = plain[:9]
        _, n_nodes, n_tetrahedra, tip, anchored_length, work_of_blade, work_of_cutting = plain[
            AMOUNTS
        ]
        n_active, cut_area, finished_area = of_cut
        tip_tetrahedron = int(tip) if has_blade else -1
        fields = (
            *(Wrench.of_numbers((a, b, c, d, e, f, g, h, i)), None, None, None, None, None),
            *(int(n_tetrahedra), int(n_nodes), n_active, tip_tetrahedron, anchored_length),
            *(cut_area, finished_area, work_of_blade, work_of_cutting, *of_step),
            *(None, None, None, None),
        )
        result: Self = tuple.__new__(cls, fields)
        x, y, z, u, v, w = plain[BOUNDS]
        result.__dict__.update(
            numbers=numbers,
            of_blade=contacts,
            geoms=geoms,
            terms=account,
            corners=((x, y, z), (u, v, w)),
        )
        return result

    def energies_of_account(self) -> Energies | None:
        """Return `energies`."""
        return None if self.terms is None else Energies(*self.terms.tolist()[:-1])

    def of_labels(self, row: int) -> FloatArray:
        """Return a row of `WrenchReport.of_labels`."""
        numbers: FloatArray = self.numbers[ADDED.stop :].reshape(2, -1)[row]
        return numbers

    def wrench_at_end(self) -> Wrench:
        """Return `wrench_t1`."""
        wrench, tip = self.numbers[9:15].copy(), self.numbers[6:9].copy()
        return Wrench(wrench[:3], wrench[3:], tip)

    def all_contacts(self) -> RigidContacts:
        """Return the contacts of the blade, and behind them those of geoms."""
        of_blade = self.of_blade
        if self.geoms is None:
            return of_blade
        both = zip(of_blade, self.geoms.contacts(), strict=True)
        return RigidContacts._make(map(np.concatenate, both))
