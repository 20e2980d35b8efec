"""Fewer cases of tests with parameters: as many as have each value of each parameter.

    pytest -p tests.support.each_value_once

That is for a second run of tests whose cases have all been run once, where it sees other things
than their figures: without the compiler each case goes the same way through the same sources.
"""

from collections.abc import Sequence

import pytest

Values = frozenset[tuple[int, str]]
"""Values of a case: the number of each `parametrize`, and what it calls the value."""


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Leave out the cases all of whose values others have."""
    cases: dict[str, list[pytest.Item]] = {}
    for item in items:
        cases.setdefault(item.nodeid.partition("[")[0], []).append(item)
    kept = {item for test in cases.values() for item in chosen(test)}
    config.hook.pytest_deselected(items=[item for item in items if item not in kept])
    items[:] = [item for item in items if item in kept]


def chosen(test: Sequence[pytest.Item]) -> list[pytest.Item]:
    """Return cases of a test that have each value at least once."""
    return [test[i] for i in each_value_once([values_of(item) for item in test])]


def values_of(item: pytest.Item) -> Values:
    """Return the values of a case; one without parameters has itself."""
    callspec = getattr(item, "callspec", None)
    # Not `params`: the values of `parametrize("a, b", ...)` belong together.
    return frozenset(enumerate(callspec._idlist if callspec else [item.nodeid]))


def each_value_once(cases: Sequence[Values]) -> list[int]:
    """Return the numbers of cases that have all values; the next adds the most."""
    missing = set().union(*cases)
    found: list[int] = []
    while missing:
        found.append(max(range(len(cases)), key=lambda i: len(cases[i] & missing)))
        missing -= cases[found[-1]]
    return sorted(found)
