"""The commands `replay` and `export`: a recorded run in a page, and as files of one instant."""

import json
import sys
import webbrowser
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import OUTPUT, PrintOptions

_PAGE = ".html"


def replay(
    file: Path,
    /,
    *,
    out: Annotated[Path | None, Parameter(name=["--out", "-o"], group=OUTPUT)] = None,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Play a recorded run in a page, with a slider for the time. Nothing is simulated.

    The page is one file, which needs no network and can be sent to others. At a terminal it is
    opened in the browser. Of a long run with a large body it has fewer than 25 frames a second, so
    that it stays below 20 MB. For example:

    ```console
    scalpel-sim run --record run.vtkhdf
    scalpel-sim replay run.vtkhdf
    scalpel-sim replay out/organ
    ```

    Args:
        file: The recording, also of a run that goes on or was killed; or the folder of a run, whose
            replay it opens, or else the one recording in it.
        out: The page, a FILE.html [default: the name of the recording with .html].
    """
    with log_to_stderr(printing):
        from scalpel_sim.output.export import check_exports
        from scalpel_sim.saved_run.playback import write_replay
        from scalpel_sim.saved_run.saved_run import SavedRun

        page = _page_in(file) if file.is_dir() and out is None else None
        if page is None:
            otherwise = (
                "neither a replay nor a recording; a run that was killed continues with "
                f"`scalpel-sim run --resume {file}`"
            )
            path = _recording_in(file, otherwise) if file.is_dir() else file
            page = path.with_suffix(_PAGE) if out is None else out
            with SavedRun(path) as run:
                check_exports([page], "--out", [_PAGE])
                write_replay(run, page)
        if printing.json:
            print(json.dumps({"page": str(page)}))
        elif not printing.quiet:
            print(f"{page}: open it in a browser", flush=True)
        if sys.stdout.isatty():
            webbrowser.open(page.absolute().as_uri())


def export(
    file: Path,
    /,
    *,
    out: Annotated[Path, Parameter(name=["--out", "-o"], group=OUTPUT)],
    at: float | None = None,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Write a recorded run at one instant to a file, for another program.

    The ending of the name says the format: .vtu, the tetrahedra of the body with stress, strain and
    labels, or .pvd, the same at all instants, for ParaView before 5.12; .glb, .usd, .usda or .usdc,
    its surface (pieces, cut faces and labels by name) and the arms at their poses; or the surface
    alone, as .obj, .ply (marked on each face) or .stl (triangles alone). All are in metres; z
    points up, in .glb y. USD needs the extra `usd` (pip install 'scalpel-sim[usd]'). For example:

    ```console
    scalpel-sim export run.vtkhdf --at 0.8 -o cut.vtu
    scalpel-sim export run.vtkhdf -o end.usd
    scalpel-sim export run.vtkhdf -o run.pvd
    ```

    Args:
        file: The recording, also of a run that goes on or was killed; or a folder with one in it.
        out: The file to write.
        at: Simulated time: the last step is written that is not after it [s; default: the end].
    """
    with log_to_stderr(printing):
        from scalpel_sim.saved_run.exports import PVD, export_series, export_step
        from scalpel_sim.saved_run.saved_run import SavedRun

        otherwise = "no recording; `scalpel-sim run --record run.vtkhdf` writes one"
        path = _recording_in(file, otherwise) if file.is_dir() else file
        is_series = out.suffix.lower() == PVD
        if is_series and at is not None:
            raise UsageError(f"a {PVD} file has all instants: leave out --at")
        with SavedRun(path) as run:
            if is_series:
                n_steps = export_series(run, out)
                if printing.json:
                    print(json.dumps({"file": str(out), "steps": n_steps}))
                elif not printing.quiet:
                    print(f"{out}: the body at {n_steps} instants, to {run.times[-1]:g} s")
                return
            step = export_step(run, at, out)
            if printing.json:
                print(json.dumps({"file": str(out), "time_s": step.time, "step": step.number}))
            elif not printing.quiet:
                print(f"{out}: the body at {step.time:g} s, step {step.number + 1} of {len(run)}")


def _page_in(folder: Path) -> Path | None:
    """Return the replay in the folder of a run; None: there is none."""
    from scalpel_sim.runs.file_names import REPLAY

    page = folder / REPLAY
    return page if page.is_file() else None


def _recording_in(folder: Path, otherwise: str) -> Path:
    """Return the one recording in a folder.

    Args:
        folder: The folder.
        otherwise: What it has where it has none, for the message.

    Raises:
        UsageError: there is none, or there are several.
    """
    from scalpel_sim.saved_run.layout import VTKHDF_SUFFIX

    found = sorted(folder.glob(f"*{VTKHDF_SUFFIX}"))
    if len(found) == 1:
        return found[0]
    if not found:
        raise UsageError(f"{folder}: has {otherwise}")
    names = ", ".join(path.name for path in found)
    raise UsageError(f"{folder}: has several recordings; choose one of {names}")
