"""The command line: `scalpel-sim run`, `view` and `serve`."""

import logging
import math
import sys
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from cyclopts import App, CycloptsError, Parameter

from bridge.tcp import DEFAULT_HOST, DEFAULT_PORT
from scalpel_sim.errors import (
    EXIT_OK,
    EXIT_RUN_FAILED,
    EXIT_WRONG_USE,
    UsageError,
    exit_code,
    one_line,
)
from scalpel_sim.plotter import Plotter
from scalpel_sim.stop_signals import StopSignals
from scalpel_sim.version import version

if TYPE_CHECKING:  # imported where they are used: `--help` should not wait for a compiler
    from bridge.link import TissueLink
    from scalpel_sim.scenes import Scene
    from scalpel_sim.simulation import Simulation
    from scalpel_sim.summary import Summary

log = logging.getLogger("scalpel_sim")

PROGRAM = "scalpel-sim"
LONGEST_RUN = 3600.0
"""[s] of simulated time: more is a slip of the keyboard."""
SHORTEST_PAUSE = 5e-3
"""[s]. Shorter ones cost more in waking up than they are worth."""
LOOK_AGAIN = 0.2
"""How often a finished `view` looks whether it is still wanted [s]."""
SECONDS_PER_PROGRESS = 0.1
"""So often is the progress bar drawn [s]."""


app = App(
    name=PROGRAM,
    version=version,
    help="A MuJoCo robot arm holds a scalpel, cuts soft tissue for real, and feels it.\n\n"
    "Exit codes: 0 done, 1 the run failed or was interrupted, 2 wrong use or bad input.",
)

SceneName = Annotated[
    str | None,
    Parameter(help="organ (default), slab, grid2 or grid7."),
]


@Parameter(name="*")
@dataclass(frozen=True)
class Body:
    """What is to be cut. What is not given is the scene's."""

    mesh: Path | None = None
    "Cut this tetrahedral mesh instead of a scene: Gmsh .msh, legacy .vtk, or .vtu."
    scale: float | None = None
    "Metres in one unit of the mesh file: 0.001 for millimetres."
    fix: str | None = None
    "What is held: sides (left, right, front, back, bottom, top), a box x0,y0,z0:x1,y1,z1, or none."
    young: float | None = None
    "Young's modulus [Pa]."
    density: float | None = None
    "Density [kg/m3]."
    toughness: float | None = None
    "Fracture toughness: what a square metre of cut costs [J/m2]."
    stretch: float | None = None
    "How far opposite held sides are pulled apart before the run, as a fraction: a slit opens."
    gravity: float | None = None
    "Gravity, downwards [m/s2]."


@Parameter(name="*")
@dataclass(frozen=True)
class Motion:
    """What is done to it, and by what. What is not given is the scene's."""

    stroke: str | None = None
    "straight, slanted, curved, stop, press, or a CSV file of times and blade poses."
    speed: float | None = None
    "How fast the blade is led [m/s]."
    arm: str | None = None
    "touch, premium, or auto: the first that reaches."
    seconds: float | None = None
    "How long to simulate [s]; else the stroke and 0.3 s more."
    seed: int = 0
    "Seed of whatever is random. Kept in summary.json."
    connect: str | None = None
    "The tissue is elsewhere: HOST:PORT of `scalpel-sim serve`."
    out: Path | None = None
    "Folder for the files; out/SCENE if not given."


@Parameter(name="*")
@dataclass(frozen=True)
class Talk:
    """How much is said."""

    json: Annotated[bool, Parameter(negative="")] = False
    "Print the summary as JSON on standard output, and nothing else there."
    quiet: Annotated[bool, Parameter(name=["--quiet", "-q"], negative="")] = False
    "Say nothing but errors."
    verbose: Annotated[bool, Parameter(name=["--verbose", "-v"], negative="")] = False
    "Say what is being done; after an error, show where it came from."


@app.command
def run(
    scene: SceneName = None,
    /,
    *,
    body: Body = Body(),
    motion: Motion = Motion(),
    talk: Talk = Talk(),
) -> None:
    """Let the arm cut, print a table, write files to a folder."""
    with _talking(talk), Plotter() as plotter, _ready(scene, body, motion, talk) as ready:
        _report(_perform(ready, motion, talk, plotter), ready.folder, talk)


@app.command
def view(
    scene: SceneName = None,
    /,
    *,
    wireframe: Annotated[bool, Parameter(negative="")] = False,
    port: int | None = None,
    body: Body = Body(),
    motion: Motion = Motion(),
    talk: Talk = Talk(),
) -> None:
    """Do the same at the speed of life, and show it live in a browser.

    On a terminal it waits for Enter, so that one can open the page first. Afterwards the page stays
    until Ctrl-C.

    Args:
        wireframe: Show the edges of the mesh.
        port: Where the page is served, on this machine only; a free port if not given.
    """
    from scalpel_sim.pictures import into_viewer, show
    from scalpel_sim.viewer import Viewer

    with _talking(talk), Plotter() as plotter, _ready(scene, body, motion, talk) as ready:
        simulation = ready.simulation
        with Viewer(
            simulation.arm.model,
            title=simulation.title,
            frame=simulation.frame,
            wireframe=wireframe,
            port=port,
        ) as viewer:
            show(viewer, simulation)
            simulation.pictures.append(into_viewer(viewer))
            _invite(viewer.url)
            summary = _perform(ready, motion, talk, plotter, at_most_real_time=True)
            show(viewer, simulation)
            _report(summary, ready.folder, talk)
            _say(f"{viewer.url} stays until Ctrl-C")
            _wait_while(lambda: viewer.is_running)


@app.command
def serve(
    scene: SceneName = None,
    /,
    *,
    host: str = DEFAULT_HOST,
    port: int = DEFAULT_PORT,
    body: Body = Body(),
    talk: Talk = Talk(),
) -> None:
    """Hold the tissue for an arm in another process: `scalpel-sim run --connect HOST:PORT`.

    Every client finds the body as at the start. Ctrl-C ends it.

    Args:
        host: Address to listen on; this machine's own only.
        port: Port to listen on; 0 for any free one.
    """
    from bridge.server import serve as serve_tissue
    from scalpel_sim.body import check, make_tissue

    with _talking(talk):
        served = _scene(scene, body)
        check(served)
        _warm_up(talk)
        serve_tissue(
            lambda: make_tissue(served),
            scene=served.name,
            host=host,
            port=port,
            on_listening=lambda address: print(
                f"{served.name} at {address}; Ctrl-C ends it", flush=True
            ),
        )


def main(arguments: Sequence[str] | None = None) -> None:
    """Do what the command line asks, and end the process with the exit code for how it went."""
    sys.exit(command_line(sys.argv[1:] if arguments is None else arguments))


def command_line(arguments: Sequence[str]) -> int:
    """Do what the arguments ask, and return the exit code.

    Every error becomes one line on standard error: what, where, why, and what to do. With
    `--verbose` the traceback comes before it.
    """
    verbose = bool({"-v", "--verbose"} & set(arguments))
    try:
        app(arguments, exit_on_error=False, print_error=False, result_action="return_value")
    except CycloptsError as error:
        _say_error(f"{error} See {PROGRAM} --help.")
        return EXIT_WRONG_USE
    except KeyboardInterrupt:
        _say_error("interrupted")
        return EXIT_RUN_FAILED
    except Exception as error:
        if verbose:
            traceback.print_exc()
        _say_error(one_line(error))
        return exit_code(error)
    return EXIT_OK


class Ready(NamedTuple):
    """A run that only has to be started."""

    simulation: "Simulation"
    folder: Path
    settings: dict[str, Any]
    """What the command line and the scene resolved to."""


@contextmanager
def _ready(name: str | None, body: Body, motion: Motion, talk: Talk) -> Iterator[Ready]:
    """Yield the run that the command line asks for, and let go of the tissue afterwards."""
    from scalpel_sim.prepare import prepare

    if motion.seconds is not None and not 0.0 < motion.seconds <= LONGEST_RUN:
        raise UsageError(
            f"--seconds is {motion.seconds}; it must be above 0 and at most {LONGEST_RUN:g}"
        )
    tissue = _tissue_here if motion.connect is None else _tissue_elsewhere
    link, scene, settings = tissue(name, body, motion, talk)
    try:
        yield Ready(prepare(scene, link), _folder(motion, scene), settings)
    finally:
        link.close()


def _tissue_here(
    name: str | None, body: Body, motion: Motion, talk: Talk
) -> tuple["TissueLink", "Scene", dict[str, Any]]:
    """Make the tissue in this process, after all checks that need none."""
    from bridge.link import InProcessLink
    from scalpel_sim.body import check, make_tissue
    from scalpel_sim.outputs import check_folder
    from scalpel_sim.scenes import changed

    scene = changed(_scene(name, body), **_given(motion))
    check(scene)
    check_folder(_folder(motion, scene))
    _warm_up(talk)
    log.info("settling %s", scene.about)
    return InProcessLink(make_tissue(scene), scene.name), scene, scene.settings()


def _tissue_elsewhere(
    name: str | None, body: Body, motion: Motion, talk: Talk
) -> tuple["TissueLink", "Scene", dict[str, Any]]:
    """Reach the tissue in another process, and take the scene from what it says of itself."""
    from bridge.tcp import TcpLink
    from scalpel_sim.outputs import check_folder
    from scalpel_sim.scenes import changed, check_motion, scene_of

    assert motion.connect is not None
    for field in fields(body):
        if getattr(body, field.name) is not None:
            raise UsageError(
                f"--{field.name} belongs to the tissue, and that is at {motion.connect}; "
                f"give it to `{PROGRAM} serve`"
            )
    link = TcpLink(motion.connect)
    try:
        scene = changed(scene_of(link), **_given(motion))
        if name not in (None, scene.name):
            raise UsageError(f"{motion.connect} holds '{scene.name}', not '{name}'")
        check_motion(scene)
        check_folder(_folder(motion, scene))
    except BaseException:
        link.close()
        raise
    elsewhere = {"fixed", "stretch", "gravity"}  # the server knows, and does not say
    settings = {key: value for key, value in scene.settings().items() if key not in elsewhere}
    return link, scene, settings | {"connect": motion.connect}


def _warm_up(talk: Talk) -> None:
    """Load the kernels; where they must be compiled first, say why nothing seems to happen."""
    from scalpel_sim.warm_up import kernels_are_compiled, warm_up

    if not talk.quiet and not kernels_are_compiled():
        _say("compiling kernels, first run only (about half a minute)")
    warm_up()


def _given(motion: Motion) -> dict[str, Any]:
    """Return what of the motion is a field of the scene."""
    return {"stroke": motion.stroke, "speed": motion.speed, "arm": motion.arm}


def _folder(motion: Motion, scene: "Scene") -> Path:
    """Return where the files go."""
    return motion.out or Path("out") / scene.name


def _scene(name: str | None, body: Body) -> "Scene":
    """Return the scene or the user's mesh, with what the user changed about it."""
    from scalpel_sim.scenes import DEFAULT_SCENE, changed, mesh_scene, scene_called

    if body.mesh is None:
        if body.scale is not None:
            raise UsageError("--scale is for a --mesh; the scenes come in metres")
        scene = scene_called(name or DEFAULT_SCENE)
    elif name is not None:
        raise UsageError(f"both the scene '{name}' and --mesh {body.mesh} are given; choose one")
    else:
        scene = mesh_scene(body.mesh, 1.0 if body.scale is None else body.scale)
    return changed(
        scene,
        fixed=body.fix,
        young_modulus=body.young,
        density=body.density,
        toughness=body.toughness,
        stretch=body.stretch,
        gravity=body.gravity,
    )


def _perform(
    ready: Ready, motion: Motion, talk: Talk, plotter: Plotter, *, at_most_real_time: bool = False
) -> "Summary":
    """Do the run, with a progress bar on a terminal."""
    from scalpel_sim.outputs import Outputs
    from scalpel_sim.run import perform, run_time

    seconds = run_time(ready.simulation, motion.seconds)
    with _progress(seconds, talk) as advance:
        after_frame = _paced(advance) if at_most_real_time else advance
        return perform(
            ready.simulation,
            Outputs(ready.folder, plotter),
            settings=ready.settings,
            seed=motion.seed,
            seconds=seconds,
            every_frame=after_frame,
        )


def _paced(after_frame: Callable[["Simulation"], None]) -> Callable[["Simulation"], None]:
    """Return the same, with a pause where simulated time would overtake the clock on the wall."""
    start = time.monotonic()

    def pause(simulation: "Simulation") -> None:
        after_frame(simulation)
        ahead = simulation.time - (time.monotonic() - start)
        if ahead > SHORTEST_PAUSE:
            time.sleep(ahead)

    return pause


def _invite(url: str) -> None:
    """Say where the page is, and give a person at a terminal the time to open it."""
    if sys.stdin is not None and sys.stdin.isatty():
        _say(f"open {url}, then press Enter to begin")
        sys.stdin.readline()
    else:
        _say(f"live at {url}")


def _wait_while(condition: Callable[[], bool]) -> None:
    """Return when the condition fails, or on Ctrl-C."""
    with StopSignals() as stop:
        while condition() and stop.reason is None:
            time.sleep(LOOK_AGAIN)


@contextmanager
def _progress(seconds: float, talk: Talk) -> Iterator[Callable[["Simulation"], None]]:
    """Yield what to call after each frame: it moves a bar if a person is looking at one."""
    if talk.quiet or not sys.stderr.isatty():
        yield lambda simulation: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.completed:.2f} of {task.total:.2f} s"),
        TextColumn("{task.fields[force]:.2f} N"),
        TimeRemainingColumn(),
    )
    # Drawn between two frames: a thread that draws would make frames wait.
    with Progress(
        *columns, console=Console(stderr=True), transient=True, auto_refresh=False
    ) as bar:
        task = bar.add_task("cutting", total=seconds, force=0.0)
        due = time.monotonic()

        def advance(simulation: "Simulation") -> None:
            nonlocal due
            if time.monotonic() >= due:
                due = time.monotonic() + SECONDS_PER_PROGRESS
                force = math.hypot(*simulation.wrench.force.tolist())
                bar.update(task, completed=simulation.time, force=force, refresh=True)

        yield advance


def _report(summary: "Summary", folder: Path, talk: Talk) -> None:
    """Say how it went."""
    if talk.json:
        from scalpel_sim.outputs import summary_json

        print(summary_json(summary))
    elif not talk.quiet:
        from rich.console import Console

        from scalpel_sim.report import print_table

        print_table(summary, Console())
        print(f"files in {folder}: {', '.join(sorted(path.name for path in folder.iterdir()))}")


@contextmanager
def _talking(talk: Talk) -> Iterator[None]:
    """Send what the parts log to standard error, as much of it as was asked for."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(_OneLine())
    root = logging.getLogger()
    level = logging.ERROR if talk.quiet else logging.INFO if talk.verbose else logging.WARNING
    before = root.level
    root.addHandler(handler)
    root.setLevel(level)
    try:
        yield
    finally:
        root.removeHandler(handler)
        root.setLevel(before)


class _OneLine(logging.Formatter):
    """`warning: unused nodes dropped`, and plain text for what is only information."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the line."""
        prefix = f"{record.levelname.lower()}: " if record.levelno >= logging.WARNING else ""
        return prefix + " ".join(record.getMessage().split())


def _say(message: str) -> None:
    """Print one line on standard error, where it cannot get between the figures."""
    print(message, file=sys.stderr, flush=True)


def _say_error(message: str) -> None:
    """Print one line on standard error."""
    _say(f"error: {' '.join(message.split())}")
