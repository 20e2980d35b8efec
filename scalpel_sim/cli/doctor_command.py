"""The command `scalpel-sim doctor`: what is there, what a lack costs, how fast scenes will be."""

import importlib.metadata
import json
import os
import platform
import re
import shutil
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from scalpel_sim.errors import RunError
from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import PrintOptions

if TYPE_CHECKING:  # what they load may be missing
    from rich.console import Console

_PACKAGE = "scalpel-sim"
_BROWSERS = (
    *("chromium", "chromium-browser", "google-chrome", "google-chrome-stable"),
    *("microsoft-edge", "firefox"),
)
_SYSTEMS_WITH_A_BROWSER = {"Darwin": "that of macOS", "Windows": "that of Windows"}

_FEWEST_CORES = 2
"""A first run compiles in as many processes."""

_COLUMNS = 3
"""Scenes in a line of the table."""

_BYTES_PER_MB = 1e6
_MS_PER_S = 1e3


class Lack(NamedTuple):
    """Something that is not there."""

    what: str
    cost: str
    """Its cost, and the remedy."""
    is_needed: bool = False
    """Whether nothing runs without it."""


class Health(NamedTuple):
    """Parts of a machine, and its speed. A part is empty where what it needs is not installed."""

    versions: dict[str, str | None]
    """Of the program, Python, and the packages that it needs; None: not installed."""
    machine: dict[str, Any]
    """Processor, vector instructions, clock [Hz], cores, memory, load."""
    kernels: dict[str, Any]
    """Where compiled kernels are, how many, and for which scenes."""
    browser: str | None
    renderer: str | None
    """OpenGL that draws images; None: there is none."""
    ffmpeg: str | None
    """The program that writes films; None: it is not on the PATH."""
    reference_frame_s: float | None
    """Processor time of a frame of the organ's cut: the one number that was measured."""
    real_time_factors: dict[str, float]
    """Of each scene the factor that `run` has with a core of its own, by that number."""
    lacks: list[Lack]


def doctor(*, printing: PrintOptions = PrintOptions()) -> None:
    """Print what is there, what a lack costs, and the real-time factor to expect of each scene.

    One number is measured, in some seconds: the processor time of a frame of the organ's cut. The
    factors follow from it, within 20 %, where the run has a core of its own. Nothing is compiled
    for it; where the kernels are not there yet, the command says how to get them. The exit code is
    1 where something is missing without which nothing runs. For example:

    ```console
    scalpel-sim doctor
    scalpel-sim doctor --json
    ```
    """
    with log_to_stderr(printing):
        health = examine()
        if printing.json:
            content = health._asdict() | {"lacks": [each._asdict() for each in health.lacks]}
            print(json.dumps(content, indent=2))
        elif not printing.quiet:
            from rich.console import Console

            print_health(health, Console(highlight=False))
        if needed := [f"{each.what}; {each.cost}" for each in health.lacks if each.is_needed]:
            raise RunError(". ".join(needed))


def examine() -> Health:
    """Return what is there, and measure how fast it is."""
    versions, lacks = _versions()
    browser, ffmpeg = _browser(lacks), _ffmpeg(lacks)
    if any(each.is_needed for each in lacks):
        return Health(versions, {}, {}, browser, None, ffmpeg, None, {}, lacks)
    renderer = _renderer(lacks)
    from scalpel_sim.scene.read import DEFAULT_SCENE
    from scalpel_sim.validate.speed.expected import expected_factors, scene_costs

    kernels = _kernels(lacks)
    machine = _machine(lacks)
    machine["clock_hz"], reference = _measured(DEFAULT_SCENE in kernels["compiled_for"])
    factors = {} if reference is None else expected_factors(reference, scene_costs())
    return Health(versions, machine, kernels, browser, renderer, ffmpeg, reference, factors, lacks)


def _versions() -> tuple[dict[str, str | None], list[Lack]]:
    """Return the versions of all that the program needs, and what of it is not installed."""
    from scalpel_sim.version import version

    found: dict[str, str | None] = {_PACKAGE: version(), "python": platform.python_version()}
    lacks: list[Lack] = []
    try:
        needs = importlib.metadata.requires(_PACKAGE) or []
    except importlib.metadata.PackageNotFoundError:
        needs = []  # a copy of the sources: what it needs shows as it is imported
    for need in needs:
        if "extra ==" in need:
            continue
        name = re.split(r"[^\w.-]", need)[0]
        try:
            found[name] = importlib.metadata.version(name)
        except importlib.metadata.PackageNotFoundError:
            found[name] = None
            cost = f'nothing runs without it: pip install "{need}"'
            lacks.append(Lack(f"{name} is not installed", cost, is_needed=True))
    return found, lacks


def _browser(lacks: list[Lack]) -> str | None:
    """Return a browser that can show the pages; None where none is found, which is added."""
    found = next(filter(None, map(shutil.which, _BROWSERS)), None)
    found = found or _SYSTEMS_WITH_A_BROWSER.get(platform.system())
    if found is None:
        cost = (
            "`view` and replay.html need one; copy replay.html to where one is, or open the page "
            "there through `ssh -L PORT:127.0.0.1:PORT`. All else works"
        )
        lacks.append(Lack("no browser is found", cost))
    return found


def _renderer(lacks: list[Lack]) -> str | None:
    """Return the OpenGL that draws images; None where there is none, which is added."""
    from scalpel_sim.camera.gl_context import RenderError, renderer_name

    try:
        return renderer_name()
    except RenderError as error:
        cost = f"`snapshot`, `film` and cameras do not work; all else does. {error.remedy}"
        lacks.append(Lack(error.what, cost))
        return None


def _ffmpeg(lacks: list[Lack]) -> str | None:
    """Return the ffmpeg on the PATH; None where there is none, which is added."""
    found = shutil.which("ffmpeg")
    if found is None:
        cost = "`film` writes an animated PNG, GIF or WebP instead of MP4 or WebM"
        lacks.append(Lack("no ffmpeg is on the PATH", cost))
    return found


def _kernels(lacks: list[Lack]) -> dict[str, Any]:
    """Return what is known of compiled kernels, and add what is missing."""
    from scalpel_sim.runs.warm_up import KernelSet, kernels_are_compiled
    from scalpel_sim.scene.read import DEFAULT_SCENE, SCENES
    from scalpel_sim.validate.speed.expected import as_run
    from tissue.support import cache_directory, is_compiling, n_compiled_kernels

    folder = cache_directory()
    sets = {name: KernelSet.of(as_run(scene)) for name, scene in SCENES.items()}
    compiled = [name for name, each in sets.items() if kernels_are_compiled(each)]
    if not is_compiling():
        compiled = []
        cost = "kernels run as plain Python, hundreds of times slower: unset it"
        lacks.append(Lack("no kernel is compiled, as NUMBA_DISABLE_JIT is set", cost))
    elif DEFAULT_SCENE not in compiled:
        cost = (
            "the first run compiles them, for half a minute to some minutes. `scalpel-sim warm-up` "
            "does it now; then this command measures the speed, too"
        )
        lacks.append(Lack(f"the kernels of {DEFAULT_SCENE} are not compiled yet", cost))
    if not _can_be_written(folder):
        cost = "what is not in it is compiled again in every run: set NUMBA_CACHE_DIR"
        lacks.append(Lack(f"the folder of kernels {folder} cannot be written", cost))
    return {
        "folder": str(folder),
        "kernels": n_compiled_kernels(),
        "bytes": sum(file.stat().st_size for file in folder.rglob("*") if file.is_file()),
        "compiled_for": compiled,
        "not_compiled_for": [name for name in SCENES if name not in compiled],
    }


def _can_be_written(folder: Path) -> bool:
    """Return whether files can be made in a folder, which itself may have to be made."""
    there = next(each for each in (folder, *folder.parents) if each.exists())
    return os.access(there, os.W_OK | os.X_OK)


def _machine(lacks: list[Lack]) -> dict[str, Any]:
    """Return the processor, its cores, and how busy they are; add it if they are few."""
    from scalpel_sim.validate.speed.machine import describe_machine, load_average, usable_cores

    load, cores = load_average(), usable_cores()
    if cores < _FEWEST_CORES:
        cost = (
            "the first run compiles for up to twice as long, and the page of `view` takes its time "
            "from the frames"
        )
        what = f"of the {_FEWEST_CORES} cores that a run makes use of this process has {cores:g}"
        lacks.append(Lack(what, cost))
    return describe_machine() | {"usable_cores": cores, "load": load}


def _measured(is_compiled: bool) -> tuple[float | None, float | None]:
    """Return the clock under load [Hz] and the processor time of a reference frame [s]."""
    from scalpel_sim.validate.speed.expected import ReferenceFrames
    from scalpel_sim.validate.speed.machine import clock_under_load, measured_clock

    if not is_compiled:
        return measured_clock(), None
    reference = ReferenceFrames().seconds()
    return clock_under_load(), reference


def print_health(health: Health, console: "Console") -> None:
    """Print what is there, what is missing, and the factors."""
    from rich.table import Table

    facts = Table(box=None, show_header=False, pad_edge=False)
    for name, text in _facts(health):
        facts.add_row(name, text)
    for lack in health.lacks:
        facts.add_row("missing", f"{lack.what}: {lack.cost}.")
    facts.columns[0].style = "bold"
    console.print(facts, markup=False)
    if health.reference_frame_s is None:
        return
    console.print(
        f"\nA frame of the organ's cut takes [bold]{_MS_PER_S * health.reference_frame_s:.2f} ms"
        "[/bold] of processor time here, as `run organ` does it: in single precision, by one "
        "thread, with an account of the energy. So expect these real-time factors of `scalpel-sim "
        "run SCENE` with a core of its own, within 20 %; above 1 is faster than real time:\n"
    )
    factors = Table(box=None, show_header=False, pad_edge=False, padding=(0, 3, 0, 0))
    for _ in range(_COLUMNS):
        factors.add_column()
        factors.add_column(justify="right")
    cells = [cell for item in health.real_time_factors.items() for cell in _cells(*item)]
    for first in range(0, len(cells), 2 * _COLUMNS):
        factors.add_row(*cells[first : first + 2 * _COLUMNS])
    console.print(factors)


def _facts(health: Health) -> list[tuple[str, str]]:
    """Return what is there, a name and a text each."""
    there = [f"{name} {number}" for name, number in health.versions.items() if number is not None]
    found = [
        ("program", ", ".join((*there[:2], platform.platform()))),
        ("packages", ", ".join(there[2:])),
    ]
    if machine := health.machine:
        from scalpel_sim.validate.speed.machine import machine_line
        from scalpel_sim.validate.speed.tables import BUSY

        cores = (
            f"{machine['usable_cores']:g} for this process; in the last minute "
            f"{machine['load']:.1f} programs ran on the machine"
        )
        if machine["load"] > BUSY:
            cores += ". They share caches and cores with this one: a quiet machine is faster"
        found += [("processor", machine_line(machine)), ("cores", cores)]
    if kernels := health.kernels:
        n, left = kernels["kernels"], kernels["not_compiled_for"]
        size = f"{n} compiled, {kernels['bytes'] / _BYTES_PER_MB:.1f} MB, in {kernels['folder']}"
        scenes = f"complete for all scenes but {', '.join(left)}" if left else "for all scenes"
        found.append(("kernels", f"{size}; {scenes}" if kernels["compiled_for"] else size))
    there_too = {"browser": health.browser, "renderer": health.renderer, "ffmpeg": health.ffmpeg}
    return found + [(name, text) for name, text in there_too.items() if text]


def _cells(scene: str, factor: float) -> tuple[str, str]:
    """Return a scene and its factor, with two digits."""
    digits = 0 if factor >= 9.95 else 1 if factor >= 0.995 else 2
    return scene, f"{factor:.{digits}f}"
