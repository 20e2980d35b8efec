"""`LazyResult`: a `StepResult` of which what a frame does not need is made when it is asked for."""

from typing import Any, Self

from tissue.blade.wrench import BladeReport
from tissue.core.lazy_fields import lazy_fields
from tissue.types import StepResult


@lazy_fields(
    wrench_t1=lambda result: result.report.wrench,
    force_on_tissue=lambda result: result.report.mean_force_on_tissue,
)
class LazyResult(StepResult):
    """The result of a step, with a copy of what the blade reported."""

    report: BladeReport

    @classmethod
    def of(cls, report: BladeReport, *others: object) -> Self:
        """Return the result of a step: its report, and the fields of `StepResult` after bounds."""
        mean_wrench, stiffness, contacts, bounds, _, _ = report
        first = (mean_wrench, None, stiffness, contacts, None, bounds)
        result: Self = _new(cls, (*first, *others))
        result.report = report
        return result


_new: Any = tuple.__new__
