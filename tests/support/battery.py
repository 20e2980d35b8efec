"""Batteries: tests of many random cases, few with `pytest -m long` and many with `pytest --long`.

`pytest` alone runs none; CI runs the few of each for each change.

A battery is a test with an argument `case`, the seed from which all of the case is drawn:

    @battery(n_per_change=50, n_long=10_000)
    def test_no_mutated_frame_has_an_effect(case):
        random = np.random.default_rng(case)
        ...

The test is called once for each case; fixtures are made once for some hundred of them. What a case
adds to the fixture `tally`, a Counter, is printed at the end.
"""

from __future__ import annotations  # pytest 8 does not name its reporter

import shlex
from collections import Counter, defaultdict
from collections.abc import Iterator
from time import perf_counter
from typing import NamedTuple

import pytest

WITHOUT_BATTERIES = "not (long or end_to_end)"
"""The tests that `pytest` runs, as `addopts` has it; `-m "long or end_to_end"` runs the others."""

MOST_FAILURES = 20
"""Failing cases after which a group of cases ends: enough to see what they have in common."""

N_GROUPS = 100
"""Groups of cases of a long battery. Each is a test item, so processes can share a battery."""

LONG_TIMEOUT = 6 * 3600
"""Time limit of a group in a long run [s]; an hour of simulated time is one case."""

DONE, TALLY = "battery", "tally"
"""Names of the entries in the report of a test: how many cases were run, and what they counted."""


class Disagreement(AssertionError):
    """A failure that a known share of the cases may have: `battery(..., disagreements=0.01)`."""


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
    disagreements: list[str]
    """The commands of those cases."""
    allowed: float
    """Share of the cases that may be disagreements."""


def battery(n_per_change: int, n_long: int, disagreements: float = 0.0) -> pytest.MarkDecorator:
    """Mark a test as a battery.

    Args:
        n_per_change: Number of cases for each change.
        n_long: Number of cases in a long run.
        disagreements: Share of all cases that may raise `Disagreement`.
    """
    return pytest.mark.long(n_per_change=n_per_change, n_long=n_long, disagreements=disagreements)


@pytest.fixture
def tally() -> Counter[str]:
    """A counter whose totals over all cases are printed at the end."""
    return Counter()


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


def pytest_configure(config: pytest.Config) -> None:
    """Run batteries where an option asks for them; by default no test with their mark is run."""
    asked = any(config.getoption(name) is not None for name in ("case", "cases"))
    if (asked or config.getoption("long")) and config.option.markexpr == WITHOUT_BATTERIES:
        config.option.markexpr = ""


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    mark = metafunc.definition.get_closest_marker("long")
    if mark is not None:
        sizes = (mark.kwargs["n_per_change"], mark.kwargs["n_long"])
        groups = list(groups_of_cases(metafunc.config, *sizes))
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
    mark = pyfuncitem.get_closest_marker("long")
    if mark is None:
        return None
    names = pyfuncitem._fixtureinfo.argnames
    arguments = {name: pyfuncitem.funcargs[name] for name in names}
    cases: Cases = arguments.pop("case")
    failures: list[str] = []
    disagreements: list[str] = []
    n_done, begun = 0, perf_counter()
    try:
        for case in range(cases.first, cases.end):
            command = command_of(pyfuncitem, cases, case)
            try:
                pyfuncitem.obj(case=case, **arguments)
            except Disagreement as error:
                disagreements.append(f"{command}  # {error}")
            except (Exception, pytest.fail.Exception):
                shown = pyfuncitem.repr_failure(pytest.ExceptionInfo.from_current())
                failures.append(f"{shown}\n\n{command}\n")
            n_done += 1
            if len(failures) == MOST_FAILURES:
                break
    finally:
        seconds, allowed = perf_counter() - begun, mark.kwargs["disagreements"]
        done = Done(n_done, len(failures), seconds, disagreements, allowed)
        pyfuncitem.user_properties.append((DONE, tuple(done)))
        plain = {name: int(n) for name, n in arguments.get("tally", {}).items()}
        pyfuncitem.user_properties.append((TALLY, plain))
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


class Total:
    """What all groups of a battery came to."""

    def __init__(self) -> None:
        self.groups: list[Done] = []
        self.tally: Counter[str] = Counter()

    @property
    def n_cases(self) -> int:
        return sum(group.n_cases for group in self.groups)

    @property
    def disagreements(self) -> list[str]:
        return [command for group in self.groups for command in group.disagreements]

    @property
    def disagrees(self) -> bool:
        """Whether more cases disagree than may."""
        return len(self.disagreements) > self.groups[0].allowed * self.n_cases

    def lines(self) -> Iterator[str]:
        n_failed = sum(group.n_failed for group in self.groups)
        seconds = sum(group.seconds for group in self.groups)
        yield f"{self.n_cases} cases, {n_failed} failed, {seconds:.1f} s"
        if self.disagreements:
            share = len(self.disagreements) / self.n_cases
            allowed = f"at most {self.groups[0].allowed:.2%} may"
            yield f"{len(self.disagreements)} disagree ({share:.2%}; {allowed})"
            yield from self.disagreements
        if self.tally:
            yield ", ".join(f"{name}: {n}" for name, n in sorted(self.tally.items()))


def totals_of(config: pytest.Config) -> dict[str, Total]:
    """Return the totals of the batteries that were run, by the name of the test."""
    totals: dict[str, Total] = defaultdict(Total)
    terminal = config.pluginmanager.getplugin("terminalreporter")
    for reports in terminal.stats.values() if terminal else ():
        for report in reports:
            for name, value in getattr(report, "user_properties", ()):
                if getattr(report, "when", None) == "call":
                    total = totals[report.nodeid.partition("[")[0]]
                    if name == DONE:
                        total.groups.append(Done(*value))
                    elif name == TALLY:
                        total.tally.update(value)
    return {node: total for node, total in totals.items() if total.groups}


@pytest.hookimpl(trylast=True)
def pytest_sessionfinish(session: pytest.Session, exitstatus: int) -> None:
    """Fail where a battery has more disagreements than it may."""
    is_worker = hasattr(session.config, "workerinput")
    if is_worker or exitstatus != pytest.ExitCode.OK:
        return
    if any(total.disagrees for total in totals_of(session.config).values()):
        session.exitstatus = pytest.ExitCode.TESTS_FAILED


def pytest_terminal_summary(
    terminalreporter: pytest.TerminalReporter, config: pytest.Config
) -> None:
    """Print how many cases of each battery were run, how many failed, and how long they took."""
    totals = totals_of(config)
    if totals:
        terminalreporter.section("batteries")
    for node, total in sorted(totals.items()):
        first, *others = total.lines()
        terminalreporter.write_line(f"{node}: {first}", red=total.disagrees)
        for line in others:
            terminalreporter.write_line(f"  {line}", red=total.disagrees)
