"""The command `scalpel-sim validate`: run the scenes, print and write what they found."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from scalpel_sim.cli.console import log_to_stderr, say
from scalpel_sim.cli.options import PrintOptions
from scalpel_sim.errors import RunError

if TYPE_CHECKING:  # `--help` should not wait for it
    from scalpel_sim.validate.findings import ValidationScene
    from scalpel_sim.validate.results import SceneRun

JSON_FILE, PAGE_FILE = "validation.json", "validation.md"


def validate(
    *,
    out: Path = Path("out/validate"),
    only: list[str] | None = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run scenes against theory and published figures; print a table, write a report with plots.

    The exit code is 0 only if every check is within its bounds, or deviates from them by no more
    than is known and explained in the report.

    Args:
        out: Folder for validation.json, validation.md and the plots.
        only: Only this scene; may be given several times. steady, symmetry, rate, slicing,
            puncture, reaction, audit, coupling, liver, gel.
        quick: A few checks of each scene, in about half a minute instead of five.
    """
    from scalpel_sim.cli.run_setup import load_kernels
    from scalpel_sim.output.run_folder import check_folder
    from scalpel_sim.output.summary import versions
    from scalpel_sim.validate.results import count_verdicts, validation_as_json
    from scalpel_sim.validate.scenes import chosen_scenes

    scenes = chosen_scenes(only or ())
    check_folder(out)
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
        raise RunError(f"{checks} out of bounds; see {out / PAGE_FILE}")


def _run(
    scenes: Sequence["ValidationScene"], *, quick: bool, printing: PrintOptions
) -> list["SceneRun"]:
    """Run the scenes one after the other, and print the title of each."""
    from scalpel_sim.validate.results import SceneRun

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
    from scalpel_sim.validate.pictures import draw_plot
    from scalpel_sim.validate.report import validation_page

    names: dict[str, list[str]] = {}
    try:
        for run in runs:
            names[run.scene.name] = []
            for i, plot in enumerate(run.findings.plots):
                name = f"validation_{run.scene.name}{i + 1 if i else ''}.png"
                draw_plot(plot, folder / name)
                names[run.scene.name].append(name)
        (folder / JSON_FILE).write_text(text + "\n", encoding="utf-8")
        page = validation_page(runs, names, quick=quick)
        (folder / PAGE_FILE).write_text(page, encoding="utf-8")
    except OSError as error:
        raise RunError(
            f"{error.filename or folder}: cannot be written ({error.strerror or error}); "
            "choose another --out"
        ) from error
