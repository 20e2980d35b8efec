"""`LazyResult`: a `StepResult` most of whose arrays are made when they are asked for."""

from typing import Any, Self

from tissue.blade.wrench import BladeReport
from tissue.core.lazy_fields import lazy_fields
from tissue.types import StepResult


@lazy_fields(
    wrench_t1=lambda result: result.report.wrench,
    stiffness=lambda result: result.report.stiffness,
    contacts=lambda result: result.report.contacts,
    force_on_tissue=lambda result: result.report.mean_force_on_tissue,
)
class LazyResult(StepResult):
    """The result of a step, with a copy of what the blade reported."""

    report: BladeReport

    @classmethod
    def of(cls, report: BladeReport, *others: object) -> Self:
        """Return the result of a step: its report, and the fields of `StepResult` after bounds."""
        result: Self = _new(cls, (report.mean_wrench, *_NOT_MADE, report.bounds, *others))
        result.report = report
        return result


_NOT_MADE = (None, None, None, None)
_new: Any = tuple.__new__
