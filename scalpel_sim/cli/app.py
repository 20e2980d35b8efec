"""The command line: `scalpel-sim run`, `view`, `serve`, `bench`, `validate`, and the others."""

import json
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, CycloptsError, Parameter

from bridge.tcp.address import DEFAULT_HOST, DEFAULT_PORT
from scalpel_sim.bench.commands import bench
from scalpel_sim.cli.console import progress, report, say, say_error, talking
from scalpel_sim.cli.options import Body, FigureNumber, Motion, SceneName, Talk
from scalpel_sim.errors import (
    EXIT_OK,
    EXIT_RUN_FAILED,
    EXIT_WRONG_USE,
    exit_code,
    one_line,
)
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.stop_signals import StopSignals
from scalpel_sim.validate.command import validate
from scalpel_sim.version import version

if TYPE_CHECKING:  # imported where they are used: `--help` should not wait for a compiler
    from scalpel_sim.cli.run_setup import Ready
    from scalpel_sim.output.summary import Summary
    from scalpel_sim.simulation import Simulation

PROGRAM = "scalpel-sim"
SHORTEST_PAUSE = 5e-3
"""[s]. Shorter ones cost more in waking up than they are worth."""
LOOK_AGAIN = 0.2
"""How often a finished `view` looks whether it is still wanted [s]."""

app = App(
    name=PROGRAM,
    version=version,
    help="A MuJoCo robot arm holds a scalpel, cuts soft tissue for real, and feels it.\n\n"
    "Exit codes: 0 done, 1 the run failed or was interrupted, 2 wrong use or bad input.",
)


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
    with talking(talk), Plotter() as plotter:  # it loads while we do
        from scalpel_sim.cli.run_setup import ready_run

        with ready_run(scene, body, motion, talk, audits=True) as ready:
            report(_perform(ready, motion, talk, plotter), ready.folder, talk)


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
    with talking(talk), Plotter() as plotter:
        from scalpel_sim.cli.run_setup import ready_run
        from scalpel_sim.viewer.pictures import into_viewer, show_in
        from scalpel_sim.viewer.viewer import Viewer

        with ready_run(scene, body, motion, talk) as ready:
            simulation = ready.simulation
            with Viewer(
                simulation.arm.model,
                title=simulation.title,
                frame=simulation.frame,
                wireframe=wireframe,
                port=port,
            ) as viewer:
                show_in(viewer, simulation)
                simulation.pictures.append(into_viewer(viewer))
                _invite(viewer.url)
                summary = _perform(ready, motion, talk, plotter, at_most_real_time=True)
                show_in(viewer, simulation)
                report(summary, ready.folder, talk)
                _stay_while(lambda: viewer.is_running, f"{viewer.url} stays until Ctrl-C")


@app.command
def serve(
    scene: SceneName = None,
    /,
    *,
    host: str = DEFAULT_HOST,
    port: int = DEFAULT_PORT,
    key: Path | None = None,
    body: Body = Body(),
    talk: Talk = Talk(),
) -> None:
    """Hold the tissue for an arm in another process: `scalpel-sim run --connect HOST:PORT`.

    Every client finds the body as at the start. Ctrl-C ends it.

    Args:
        host: Address to listen on; with a key any, such as 0.0.0.0, else this machine's own only.
        port: Port to listen on; 0 for any free one.
        key: Serve only who has the key in this file; else in SCALPEL_SIM_KEY, if that is set.
    """
    from bridge import serve as serve_tissue
    from bridge.tcp.keys import chosen_key
    from scalpel_sim.cli.run_setup import chosen_scene, load_kernels, springs_as_asked
    from scalpel_sim.scene_body import check, make_tissue

    with talking(talk):
        secret = chosen_key(key)
        served = chosen_scene(scene, body)
        check(served)
        served, springs = springs_as_asked(served, body)
        if springs and not talk.quiet:
            say(", ".join(f"{key} {value:.4g}" for key, value in springs["springs"].items()))
        load_kernels(talk)
        serve_tissue(
            lambda: make_tissue(served),
            scene=served.name,
            host=host,
            port=port,
            key=secret,
            on_listening=lambda address: print(
                f"{served.name} at {address}; Ctrl-C ends it", flush=True
            ),
        )


@app.command
def key(file: Path, /, *, talk: Talk = Talk()) -> None:
    """Write a new random key to a file, for `serve --key` and, copied there, `run --key`.

    Whoever has the file can connect, so hand it over as you would a password.

    Args:
        file: Must not exist yet. Only you can read it.
    """
    from bridge.tcp.keys import write_new_key

    with talking(talk):
        write_new_key(file)
        if not talk.quiet:
            print(f"{file}: a new key, readable by you alone")


app.command(bench)
app.command(validate)


@app.command
def materials(name: str | None = None, /, *, talk: Talk = Talk()) -> None:
    """Print the materials that --material knows, with the source of each figure.

    Args:
        name: One of them; all if not given.
    """
    with talking(talk):
        from scalpel_sim.cli.materials import as_json, chosen_presets, print_presets

        presets = chosen_presets(name)
        if talk.json:
            print(as_json(presets))
        else:
            print_presets(presets)


@app.command
def figure(
    number: FigureNumber,
    /,
    *,
    output: Path | None = None,
    scheme: str = "stellar",
    talk: Talk = Talk(),
) -> None:
    """Do the cuts of the paper's Figure 10, 11 or 12 and draw them as a PNG; no screen is needed.

    Figure 10: four frames of a cut through 4 x 6 x 4 cells. Figure 11: the mesh in the first and
    the last of them. Figure 12: arbitrary paths through 2 x 2 x 2 and 7 x 7 x 7 cells.

    Args:
        number: 10, 11 or 12.
        output: The file; figure10.png (11, 12) in this folder if not given.
        scheme: How the mesh is cut: stellar, or paper for the paper's own scheme.
    """
    from scalpel_sim.output.run_folder import check_file
    from scalpel_sim.scenes import check_scheme

    path = output or Path(f"figure{number}.png")
    with talking(talk):
        check_scheme(scheme)
        check_file(path, ".png", "--output")
        from scalpel_sim.cli.run_setup import load_kernels
        from scalpel_sim.figures.figures import draw_figure

        load_kernels(talk)
        if not talk.quiet:
            say(f"cutting and drawing Figure {number}: about half a minute")
        drawn = draw_figure(number, path, scheme)
        if talk.json:
            print(json.dumps({"figure": number, "file": str(path)} | drawn._asdict(), indent=2))
        elif not talk.quiet:
            print(f"{path}: {drawn.caption}")


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
        say_error(f"{error} See {PROGRAM} --help.")
        return EXIT_WRONG_USE
    except KeyboardInterrupt:
        say_error("interrupted")
        return EXIT_RUN_FAILED
    except Exception as error:
        if verbose:
            traceback.print_exc()
        say_error(one_line(error))
        return exit_code(error)
    return EXIT_OK


def _perform(
    ready: "Ready", motion: Motion, talk: Talk, plotter: Plotter, *, at_most_real_time: bool = False
) -> "Summary":
    """Do the run, with a progress bar on a terminal."""
    from scalpel_sim.output.run_folder import Outputs
    from scalpel_sim.run import perform, run_time

    seconds = run_time(ready.simulation, motion.seconds)
    with progress(seconds, talk) as advance:
        after_frame = _paced(advance) if at_most_real_time else advance
        return perform(
            ready.simulation,
            Outputs(ready.folder, plotter),
            settings=ready.settings,
            seed=motion.seed,
            seconds=seconds,
            every_frame=after_frame,
            exports=motion.export,
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
        say(f"open {url}, then press Enter to begin")
        sys.stdin.readline()
    else:
        say(f"live at {url}")


def _stay_while(condition: Callable[[], bool], message: str) -> None:
    """Say so, and return when the condition fails, or on Ctrl-C."""
    with StopSignals() as stop:
        say(message)  # from now on Ctrl-C is heard
        while condition() and stop.reason is None:
            time.sleep(LOOK_AGAIN)
