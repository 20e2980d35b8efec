"""The command `scalpel-sim validate`: run the scenes, print and write what they found."""

import gc
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from scalpel_sim.errors import CheckError, UsageError, writing
from scalpel_sim.runs.console import log_to_stderr, say
from scalpel_sim.runs.options import PrintOptions
from tissue.support import whole_file

if TYPE_CHECKING:  # `--help` should not wait for it
    from scalpel_sim.scene.case import CaseContent
    from scalpel_sim.validate.cases.runner import CaseRecord
    from scalpel_sim.validate.findings import ValidationScene
    from scalpel_sim.validate.report import SceneRun

JSON_FILE, PAGE_FILE = "validation.json", "validation.md"
_FOLDER = Path("out/validate")
_SECONDS_PER_LINE = 5.0
"""Interval at which a case reports its progress [s]."""


def validate(
    *,
    case: Path | None = None,
    out: Path | None = None,
    only: list[str] | None = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run scenes against theory and published figures; print a table, write a report with plots.

    The exit code is 3 where a check is out of its bounds by more than is known and explained in
    the report.

    With `--case` an experiment of yours is run instead, and compared with what its file expects, as
    `run FILE.toml` does.
    For example:

    ```console
    scalpel-sim validate --only steady --quick
    scalpel-sim validate --case docs/examples/tension.toml
    ```

    Args:
        case: Run the case in this FILE.toml (docs/scenes.md) instead of the scenes.
        out: Folder for the report, its data and the plots; out/validate by default, with a case
            out/ and the name of its file.
        only: Only this scene; may be given several times. beam, stretch, steady,
            symmetry, rate, slicing, puncture, spine, reaction, contact, audit, coupling,
            liver, incision, gel, tension, silicone_bar, tissue_curves.
        quick: A few checks of each scene, in a minute or two instead of seven.
    """
    if case is not None:
        if only or quick:
            raise UsageError("--case runs one experiment; --only and --quick are for the scenes")
        perform_case(case, out, printing)
        return
    from scalpel_sim.output.summary import versions
    from scalpel_sim.runs.prepared_run import load_kernels
    from scalpel_sim.runs.run_folder import make_folder
    from scalpel_sim.validate.report import count_verdicts, validation_as_json
    from scalpel_sim.validate.scenes import chosen_scenes

    out = out or _FOLDER
    scenes = chosen_scenes(only or ())
    make_folder(out)
    with log_to_stderr(printing):
        load_kernels(printing)
        runs = _run(scenes, quick=quick, printing=printing)
        text = validation_as_json(runs, quick=quick, versions=versions())
        _write(out, runs, text, quick=quick)
    if printing.json:
        print(text)
    elif not printing.quiet:
        from rich.console import Console

        from scalpel_sim.validate.report import print_checks

        print_checks(runs, Console())
        print(f"files in {out}: {JSON_FILE}, {PAGE_FILE} and plots")
    failed = count_verdicts(runs).failed
    if failed:
        checks = "1 check is" if failed == 1 else f"{failed} checks are"
        raise CheckError(f"{checks} out of bounds; see {out / PAGE_FILE}")


def perform_case(path: Path, out: Path | None, printing: PrintOptions) -> None:
    """Run the case in a file; print and write what it found.

    Args:
        path: The file.
        out: Folder of what it writes; None for `out/` and the name of the file.
        printing: What is printed.

    Raises:
        UsageError: the file, or a file that it names, is wrong.
        RunError: the run failed, or a file cannot be written.
        CheckError: what the case expects is missed.
    """
    from scalpel_sim.output.summary import versions
    from scalpel_sim.runs.run_folder import make_folder
    from scalpel_sim.scene.case import read_case
    from scalpel_sim.validate.cases.expected import check_expected, curves_of
    from scalpel_sim.validate.cases.report import CaseFindings, case_as_json, print_case, write_case

    out = out or Path("out") / path.stem
    case = read_case(path)
    curves = curves_of(case)
    make_folder(out)
    with log_to_stderr(printing):
        started = time.perf_counter()
        record = _run_case(case, printing)
        expected = zip(case.expected, curves, strict=True)
        checks = [check_expected(each, curve, record) for each, curve in expected]
        found = CaseFindings(case, record, checks, curves, time.perf_counter() - started)
        files = write_case(out, found, versions())
    if printing.json:
        print(case_as_json(found, versions()))
    elif not printing.quiet:
        from rich.console import Console

        print_case(found, Console())
        print(f"files in {out}: {', '.join(files)}")
    if not found.has_passed:
        raise CheckError(f"{path}: what it expects is missed; see {out / files[0]}")


def _run_case(case: "CaseContent", printing: PrintOptions) -> "CaseRecord":
    """Run a case; say from time to time how far it is."""
    from scalpel_sim.validate.cases.runner import assemble, run_case

    gc.enable()  # a start runs without it
    said = time.monotonic()

    def report(seconds: float) -> None:
        nonlocal said
        if not printing.quiet and time.monotonic() - said > _SECONDS_PER_LINE:
            said = time.monotonic()
            say(f"{seconds:.3g} of {case.run.seconds:.3g} s")

    if not printing.quiet:
        say(f"{case.title}: {case.run.seconds:g} s")
    return run_case(case, assemble(case), report)


def _run(
    scenes: Sequence["ValidationScene"], *, quick: bool, printing: PrintOptions
) -> list["SceneRun"]:
    """Run the scenes one after the other, and print the title of each."""
    from scalpel_sim.validate.report import SceneRun

    runs = []
    for i, scene in enumerate(scenes):
        if not printing.quiet:
            say(f"{i + 1} of {len(scenes)}: {scene.title}")
        started = time.perf_counter()
        findings = scene.measure(quick)
        runs.append(SceneRun(scene, findings, time.perf_counter() - started))
    return runs


def _write(folder: Path, runs: Sequence["SceneRun"], text: str, *, quick: bool) -> None:
    """Write the report, its data and its plots to a folder.

    Raises:
        RunError: a file cannot be written.
    """
    from scalpel_sim.validate.report import draw_plot, validation_page

    names: dict[str, list[str]] = {}
    with writing(folder, "another --out"):
        for run in runs:
            names[run.scene.name] = []
            for i, plot in enumerate(run.findings.plots):
                name = f"validation_{run.scene.name}{i + 1 if i else ''}.png"
                draw_plot(plot, folder / name)
                names[run.scene.name].append(name)
        page = validation_page(runs, names, quick=quick)
        for name, content in ((JSON_FILE, text + "\n"), (PAGE_FILE, page)):
            with whole_file(folder / name) as unfinished:
                unfinished.write_text(content, encoding="utf-8")
