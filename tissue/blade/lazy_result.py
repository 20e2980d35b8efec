"""`LazyResult`: a `StepResult` of which what a frame does not need is made when it is asked for."""

from typing import Any, Self

import numpy as np

from tissue.blade.wrench import BladeReport
from tissue.contact.geoms.geom_contact import GeomContact
from tissue.core.lazy_fields import lazy_fields
from tissue.types import RigidContacts, StepResult


@lazy_fields(
    contacts=lambda result: result.all_contacts(),
    wrench_t1=lambda result: result.report.wrench,
    force_on_tissue=lambda result: result.report.mean_force_on_tissue,
)
class LazyResult(StepResult):
    """The result of a step, with a copy of what the blade reported."""

    report: BladeReport
    geoms: GeomContact | None

    @classmethod
    def of(cls, report: BladeReport, geoms: GeomContact | None, *others: object) -> Self:
        """Return the result of a step.

        Args:
            report: That of the blade.
            geoms: Contact with geoms, where there is any.
            others: The fields of `StepResult` after bounds.
        """
        mean_wrench, stiffness, _, bounds, _, _ = report
        first = (mean_wrench, None, stiffness, None, None, bounds)
        result: Self = _new(cls, (*first, *others))
        result.report, result.geoms = report, geoms
        return result

    def all_contacts(self) -> RigidContacts:
        """Return the contacts of the blade, and behind them those of geoms."""
        of_blade = self.report.contacts
        if self.geoms is None:
            return of_blade
        both = zip(of_blade, self.geoms.contacts(), strict=True)
        return RigidContacts._make(map(np.concatenate, both))


_new: Any = tuple.__new__
