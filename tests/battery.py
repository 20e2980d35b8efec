"""Batteries: tests of many random cases, few for each change and many with `pytest --long`.

A battery is a test with an argument `case`, the seed from which all of the case is drawn:

    @battery(n_per_change=50, n_long=10_000)
    def test_no_mutated_frame_has_an_effect(case):
        random = np.random.default_rng(case)
        ...

The test is called once for each case; fixtures are made once for some hundred of them.
"""

import shlex
from collections import defaultdict
from collections.abc import Iterator
from time import perf_counter
from typing import NamedTuple

import pytest

MOST_FAILURES = 20
"""Failing cases after which a group of cases ends: enough to see what they have in common."""

N_GROUPS = 100
"""Groups of cases of a long battery. Each is a test item, so processes can share a battery."""

LONG_TIMEOUT = 6 * 3600
"""Time limit of a group in a long run [s]; an hour of simulated time is one case."""

PROPERTY = "battery"
"""Name of the entry in the report of a test that says how many cases were run."""


class Cases(NamedTuple):
    """A group of cases that are run in one test item."""

    first: int
    end: int
    """The number after the last."""

    @property
    def name(self) -> str:
        return f"{self.first}:{self.end}"


class Done(NamedTuple):
    """What a group of cases came to."""

    n_cases: int
    n_failed: int
    seconds: float


def battery(n_per_change: int, n_long: int) -> pytest.MarkDecorator:
    """Mark a test as a battery of that many cases for each change, and in a long run."""
    return pytest.mark.long(n_per_change=n_per_change, n_long=n_long)


def first_and_end(text: str) -> tuple[int, int]:
    """Return the two numbers of `FIRST:LAST`."""
    first, _, end = text.partition(":")
    return int(first), int(end)


def pytest_addoption(parser: pytest.Parser) -> None:
    group = parser.getgroup("battery", "batteries of random cases")
    group.addoption("--long", action="store_true", help="run batteries in their long size")
    group.addoption("--case", type=int, metavar="N", help="run only case N of each battery")
    group.addoption(
        "--cases",
        type=first_and_end,
        metavar="FIRST:LAST",
        help="run only these cases of each battery; LAST is not run, as in a slice",
    )


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    mark = metafunc.definition.get_closest_marker("long")
    if mark is not None:
        groups = list(groups_of_cases(metafunc.config, **mark.kwargs))
        metafunc.parametrize("case", groups, ids=[cases.name for cases in groups])


def groups_of_cases(config: pytest.Config, n_per_change: int, n_long: int) -> Iterator[Cases]:
    """Yield the groups of cases that the options ask for."""
    is_long, case = config.getoption("long"), config.getoption("case")
    first, end = config.getoption("cases") or (0, n_long if is_long else n_per_change)
    if case is not None:
        first, end = case, case + 1
    size = -(-n_long // N_GROUPS) if is_long else end - first
    for start in range(first, end, max(size, 1)):
        yield Cases(start, min(start + size, end))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if config.getoption("long") and config.pluginmanager.hasplugin("timeout"):
        for item in items:
            if item.get_closest_marker("long"):
                item.add_marker(pytest.mark.timeout(LONG_TIMEOUT))


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Call a battery once for each case; fail at the end, with the command for each failure."""
    if pyfuncitem.get_closest_marker("long") is None:
        return None
    names = pyfuncitem._fixtureinfo.argnames
    arguments = {name: pyfuncitem.funcargs[name] for name in names}
    cases: Cases = arguments.pop("case")
    failures: list[str] = []
    n_done, begun = 0, perf_counter()
    try:
        for case in range(cases.first, cases.end):
            try:
                pyfuncitem.obj(case=case, **arguments)
            except (Exception, pytest.fail.Exception):
                shown = pyfuncitem.repr_failure(pytest.ExceptionInfo.from_current())
                failures.append(f"{shown}\n\n{command_of(pyfuncitem, cases, case)}\n")
            n_done += 1
            if len(failures) == MOST_FAILURES:
                break
    finally:
        done = Done(n_done, len(failures), perf_counter() - begun)
        pyfuncitem.user_properties.append((PROPERTY, tuple(done)))
    if failures:
        several = f"{len(failures)} of {n_done} cases failed; each is followed by its command\n\n"
        pytest.fail(several + "\n".join(failures), pytrace=False)
    return True


def command_of(item: pytest.Function, cases: Cases, case: int) -> str:
    """Return the command that runs one case of a battery alone."""
    size = ["--long"] if item.config.getoption("long") else []
    node, bracket, parameters = item.nodeid.partition("[")
    if parameters != f"{cases.name}]":  # the battery has parameters of its own
        alone = Cases(case, case + 1)
        node += bracket + parameters.replace(cases.name, alone.name)
    return shlex.join(["pytest", *size, node, "--case", str(case)])


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Print how many cases of each battery were run, how many failed, and how long they took."""
    done = defaultdict(list)
    for reports in terminalreporter.stats.values():
        for report in reports:
            for name, value in getattr(report, "user_properties", ()):
                if name == PROPERTY and report.when == "call":
                    done[report.nodeid.partition("[")[0]].append(Done(*value))
    if done:
        terminalreporter.section("batteries")
    for node, groups in sorted(done.items()):
        n, n_failed, seconds = map(sum, zip(*groups, strict=True))
        terminalreporter.write_line(f"{node}: {n} cases, {n_failed} failed, {seconds:.1f} s")
