"""Compares the records of a case with the curves and values that it expects."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scalpel_sim.errors import UsageError
from scalpel_sim.scene.case import TIME, CaseContent, ExpectedTable
from scalpel_sim.strokes.csv_lines import numbered_lines, numbers_of
from scalpel_sim.validate.cases.runner import CaseRecord
from scalpel_sim.validate.findings import CASE, Check
from tissue import BoolArray, FloatArray


class ExpectedCurve(NamedTuple):
    """A curve from a file, in SI units."""

    x: FloatArray
    """Time, or the record that it is against, ascending; shape (n,)."""
    y: FloatArray
    """The record, shape (n,)."""


def read_curve(path: Path) -> ExpectedCurve:
    """Return the curve in a CSV file: two columns of numbers, x and y, below one line of names.

    Raises:
        UsageError: the file cannot be read, a row is not two finite numbers, or x does not ascend.
    """
    _, *lines = numbered_lines(path, "curve", ("x", "y"))
    rows = [numbers_of(path, *line, [0, 1]) for line in lines]
    if len(rows) < 2:
        raise UsageError(f"{path} holds {len(rows)} rows below its line of names; give two or more")
    x, y = np.array(rows).T
    if not (np.diff(x) > 0.0).all():
        raise UsageError(f"{path}: the first column must ascend")
    if not y.any():
        raise UsageError(f"{path}: the curve is 0 everywhere, and the tolerance is a share of it")
    return ExpectedCurve(x, y)


def curves_of(case: CaseContent) -> list[ExpectedCurve | None]:
    """Return the curve of each expectation; None for a value.

    Raises:
        UsageError: a file cannot be used; see `read_curve`.
    """
    return [
        None if expected.file is None else read_curve(Path(expected.file))
        for expected in case.expected
    ]


def check_expected(
    expected: ExpectedTable, curve: ExpectedCurve | None, record: CaseRecord
) -> Check:
    """Return the check of one expectation.

    A value is compared with the mean of the record from `from_time` to `to_time`. Of a curve the
    largest deviation at its points counts, as a share of its largest magnitude; a point beyond what
    was recorded makes it fail.
    """
    y, rows = record.columns[expected.record], _rows(expected, record)
    unit = record.units[expected.record]
    if curve is None:
        assert expected.value is not None
        mean = float(y[rows].mean()) if rows.any() else math.nan
        low, high = sorted(expected.value * (1.0 + s * expected.tolerance) for s in (-1.0, 1.0))
        return Check(f"{expected.record}: mean", mean, low, high, basis=CASE, unit=unit)
    name = f"{expected.record} against {expected.against}: largest deviation / largest expected"
    x = record.columns[expected.against][rows]
    return Check(name, _deviation(x, y[rows], curve), 0.0, expected.tolerance, basis=CASE)


def _rows(expected: ExpectedTable, record: CaseRecord) -> BoolArray:
    """Return which rows are compared, shape (n_rows,)."""
    time = record.columns[TIME]
    last = np.inf if expected.to_time is None else expected.to_time
    return np.asarray((time >= expected.from_time - 1e-9) & (time <= last + 1e-9))


def _deviation(x: FloatArray, y: FloatArray, curve: ExpectedCurve) -> float:
    """Return the largest deviation from a curve over its largest magnitude; NaN where x is wrong.

    `x` must go one way, and reach over the whole curve but for a thousandth of its length.
    """
    steps = np.diff(x)
    if (steps < 0.0).all():
        x, y = x[::-1], y[::-1]
    elif not (len(x) > 1 and (steps > 0.0).all()):
        return math.nan
    slack = 1e-3 * (curve.x[-1] - curve.x[0])
    if curve.x[0] < x[0] - slack or curve.x[-1] > x[-1] + slack:
        return math.nan
    found = np.interp(curve.x, x, y)
    return float(np.abs(found - curve.y).max() / np.abs(curve.y).max())
