"""The command `scalpel-sim validate`: run the scenes, say and write what they found."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from scalpel_sim.cli.console import log_to_stderr, say
from scalpel_sim.cli.options import PrintOptions
from scalpel_sim.errors import RunError

if TYPE_CHECKING:  # `--help` should not wait for it
    from scalpel_sim.validate.findings import Scene
    from scalpel_sim.validate.results import Done

JSON, PAGE = "validation.json", "validation.md"


def validate(
    *,
    out: Path = Path("out/validate"),
    only: list[str] | None = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run scenes against theory and published figures; print a table, write a report with plots.

    The exit code is 0 only if every line is within its bounds, or out of them by no more than what
    is known and explained in the report.

    Args:
        out: Folder for validation.json, validation.md and the plots.
        only: Only this scene; may be given several times. steady, symmetry, rate, slicing,
            puncture, reaction, audit, coupling, liver, gel.
        quick: A few lines of each scene, in half a minute instead of some five.
    """
    from scalpel_sim.cli.run_setup import load_kernels
    from scalpel_sim.output.run_folder import check_folder
    from scalpel_sim.output.summary import versions
    from scalpel_sim.validate.results import as_json, counts
    from scalpel_sim.validate.scenes import chosen

    scenes = chosen(only or ())
    check_folder(out)
    with log_to_stderr(printing):
        load_kernels(printing)
        done = _run(scenes, quick=quick, printing=printing)
        text = as_json(done, quick=quick, versions=versions())
        write(out, done, text, quick=quick)
    if printing.json:
        print(text)
    elif not printing.quiet:
        from rich.console import Console

        from scalpel_sim.validate.report import print_table

        print_table(done, Console())
        print(f"files in {out}: {JSON}, {PAGE} and plots")
    failed = counts(done).failed
    if failed:
        raise RunError(f"{failed} lines are out of their bounds; {out / PAGE} says which")


def _run(scenes: Sequence["Scene"], *, quick: bool, printing: PrintOptions) -> list["Done"]:
    """Run the scenes one after the other, and say which one is on."""
    from scalpel_sim.validate.results import Done

    done = []
    for i, scene in enumerate(scenes):
        if not printing.quiet:
            say(f"{i + 1} of {len(scenes)}: {scene.title}")
        started = time.perf_counter()
        findings = scene.measure(quick)
        done.append(Done(scene, findings, time.perf_counter() - started))
    return done


def write(folder: Path, done: Sequence["Done"], text: str, *, quick: bool) -> None:
    """Write the report, its data and its plots to a folder.

    Raises:
        RunError: the system refuses.
    """
    from scalpel_sim.validate.pictures import draw
    from scalpel_sim.validate.report import as_markdown

    names: dict[str, list[str]] = {}
    try:
        for each in done:
            names[each.scene.name] = []
            for i, plot in enumerate(each.findings.plots):
                name = f"validation_{each.scene.name}{i + 1 if i else ''}.png"
                draw(plot, folder / name)
                names[each.scene.name].append(name)
        (folder / JSON).write_text(text + "\n", encoding="utf-8")
        page = as_markdown(done, names, quick=quick)
        (folder / PAGE).write_text(page, encoding="utf-8")
    except OSError as error:
        raise RunError(
            f"{error.filename or folder}: cannot be written ({error.strerror or error}); "
            "choose another --out"
        ) from error
