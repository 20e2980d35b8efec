"""The command line: `scalpel-sim run`, `view`, `serve`, `bench`, `validate`, and the others."""

import gc
import sys
import time
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, CycloptsError, Parameter

from bridge import DEFAULT_HOST, DEFAULT_PORT
from scalpel_sim.bench.commands import bench
from scalpel_sim.cli.console import log_to_stderr, print_report, progress, say, say_error
from scalpel_sim.cli.new_command import new
from scalpel_sim.cli.options import (
    CONNECTION,
    OUTPUT,
    PAGE,
    ArmOptions,
    ClientOptions,
    Flag,
    OutputOptions,
    PrintOptions,
    SceneName,
    TissueOptions,
)
from scalpel_sim.cli.warm_up_command import warm_up
from scalpel_sim.errors import (
    EXIT_OK,
    EXIT_RUN_FAILED,
    EXIT_WRONG_USE,
    UsageError,
    exit_code,
    one_line,
)
from scalpel_sim.figures.command import figure
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.stop_signals import StopSignals
from scalpel_sim.validate.command import validate
from scalpel_sim.version import version

if TYPE_CHECKING:  # imported where they are used: `--help` should not wait for a compiler
    from scalpel_sim.cli.run_setup import PreparedRun, RunOptions
    from scalpel_sim.output.summary import Summary
    from scalpel_sim.simulation import Simulation

PROGRAM = "scalpel-sim"
SHORTEST_PAUSE = 5e-3
"""Shortest pause that slows a run to real time [s]: a shorter one costs more than it gains."""
SECONDS_PER_CHECK = 0.2
"""How often a finished `view` checks whether its page is still wanted [s]."""

app = App(
    name=PROGRAM,
    version=version,
    help="A MuJoCo robot arm holds a scalpel, cuts soft tissue for real, and feels it.\n\n"
    "Exit codes: 0 done, 1 the run failed or was interrupted, 2 wrong use or bad input, 3 a "
    "check of a validation failed.",
)


@app.command(name="run")
def _run(
    scene: SceneName = None,
    /,
    *,
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    client: ClientOptions = ClientOptions(),
    output: OutputOptions = OutputOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Cut a body with the arm, print a table, and write files to a folder.

    For example:

    ```console
    scalpel-sim run
    scalpel-sim run slab --stroke curved --toughness 10
    scalpel-sim run organ --material liver --blade-thickness 0.001 --out out/liver
    scalpel-sim run --mesh organ.msh --scale 0.001 --fix bottom --material mine.toml
    ```
    """
    with log_to_stderr(printing), Plotter() as plotter:  # it loads while the run is prepared
        from scalpel_sim.cli.run_setup import RunOptions, prepared_run

        options = RunOptions(tissue, arm, client, output, printing)
        with prepared_run(scene, options, audits=True) as prepared:
            summary = _perform(prepared, options, plotter)
            print_report(summary, prepared.folder, output.export, printing)


@app.command(name="view")
def _view(
    scene: SceneName = None,
    /,
    *,
    wireframe: Annotated[Flag, Parameter(group=PAGE)] = False,
    port: Annotated[int | None, Parameter(group=PAGE)] = None,
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    client: ClientOptions = ClientOptions(),
    output: OutputOptions = OutputOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run at real-time speed, and show the cut live in a browser.

    On a terminal it waits for Enter, so that you can open the page first. Afterwards the page stays
    until Ctrl-C. The motion is advanced by --relaxation verlet, unless you choose another
    or the tissue stiffens.

    For example:

    ```console
    scalpel-sim view
    scalpel-sim view slab --wireframe --port 8080
    ```

    Args:
        wireframe: Show the edges of the mesh.
        port: Port of the page, on this machine only [default: any free port].
    """
    with log_to_stderr(printing), Plotter() as plotter:
        from scalpel_sim.cli.run_setup import RunOptions, prepared_run
        from scalpel_sim.viewer.pictures import into_viewer, show_in
        from scalpel_sim.viewer.viewer import Viewer

        options = RunOptions(tissue, arm, client, output, printing)
        with prepared_run(scene, options, relaxation="verlet") as prepared:
            simulation = prepared.simulation
            with Viewer(
                simulation.arm.model,
                title=simulation.title,
                frame=simulation.frame,
                wireframe=wireframe,
                port=port,
                views=prepared.scene.views,
            ) as viewer:
                show_in(viewer, simulation)
                simulation.pictures.append(into_viewer(viewer))
                _wait_for_start(viewer.url)
                summary = _perform(prepared, options, plotter, at_most_real_time=True)
                show_in(viewer, simulation)
                print_report(summary, prepared.folder, output.export, printing)
                _stay_while(lambda: viewer.is_running, f"{viewer.url} stays until Ctrl-C")


@app.command(name="serve")
def _serve(
    scene: SceneName = None,
    /,
    *,
    host: Annotated[str, Parameter(group=CONNECTION)] = DEFAULT_HOST,
    port: Annotated[int, Parameter(group=CONNECTION)] = DEFAULT_PORT,
    key: Annotated[Path | None, Parameter(group=CONNECTION)] = None,
    tissue: TissueOptions = TissueOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Hold the tissue for an arm in another process: `scalpel-sim run --connect HOST:PORT`.

    Every client finds the body as at the start. Ctrl-C ends it.

    For example, on two machines that share the file link.key:

    ```console
    scalpel-sim serve organ --host 0.0.0.0 --key link.key
    scalpel-sim run --connect tissue.example.org:8766 --key link.key
    ```

    Args:
        host: Address to listen on: any with a key, such as 0.0.0.0; else one of this machine alone.
        port: Port to listen on; 0 for any free one.
        key: Serve only clients that have the key in this file [default: the key in
            SCALPEL_SIM_KEY, if that is set].
    """
    from bridge import chosen_key
    from bridge import serve as serve_tissue
    from scalpel_sim.cli.run_setup import load_kernels, springs_as_asked
    from scalpel_sim.cli.scene_options import chosen_scene
    from scalpel_sim.scene_body import check_scene, make_tissue
    from scalpel_sim.tables.view import sent_views

    with log_to_stderr(printing):
        secret = chosen_key(key)
        served = chosen_scene(scene, tissue)
        check_scene(served)
        served, springs = springs_as_asked(served, tissue.material)
        if springs and not printing.quiet:
            say(", ".join(f"{name} {value:.4g}" for name, value in springs["springs"].items()))
        load_kernels(printing, served)
        serve_tissue(
            lambda: make_tissue(served),
            scene=served.name,
            views=sent_views(served.views),
            host=host,
            port=port,
            key=secret,
            on_listening=lambda address: print(
                f"{served.name} at {address}; Ctrl-C ends it", flush=True
            ),
        )


@app.command(name="key")
def _key(file: Path, /, *, printing: PrintOptions = PrintOptions()) -> None:
    """Write a new random key to a file, for `serve --key` and, copied there, `run --key`.

    Everyone who has the file can connect, so hand it over as you would a password. For example:

    ```console
    scalpel-sim key link.key
    ```

    Args:
        file: Must not exist yet. Only you can read it.
    """
    from bridge import write_new_key

    with log_to_stderr(printing):
        write_new_key(file)
        if not printing.quiet:
            print(f"{file}: a new key, readable by you alone")


app.command(warm_up, name="warm-up")
app.command(bench)
app.command(figure)
app.command(new)
app.command(validate)


@app.command(name="materials")
def _materials(
    name: str | None = None,
    /,
    *,
    write: Annotated[Path | None, Parameter(group=OUTPUT)] = None,
    force: Annotated[Flag, Parameter(group=OUTPUT)] = False,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Print the materials that --material knows, with the source of each figure.

    Or write the numbers of a material and of a scalpel to a file, with a comment on each, to be
    changed and given as --material and --blade:

    ```console
    scalpel-sim materials liver --write mine.toml
    scalpel-sim run organ --material mine.toml --blade mine.toml
    ```

    Args:
        name: One of them [default: all; to write, the soft gel of the scenes].
        write: Write this FILE.toml instead of printing.
        force: Replace the file if it exists.
    """
    with log_to_stderr(printing):
        from scalpel_sim.cli.materials import chosen_presets, presets_as_json, print_presets

        if write is not None:
            from scalpel_sim.cli.material_template import write_template

            write_template(write, name, force=force)
            if not printing.quiet:
                print(f"{write}: written; use it with --material {write} --blade {write}")
            return
        if force:
            raise UsageError("--force is for --write FILE.toml; add that, or omit it")
        presets = chosen_presets(name)
        if printing.json:
            print(presets_as_json(presets))
        else:
            print_presets(presets)


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the command line, and end the process with its exit code."""
    # What is loaded lives as long as the process: to look for cycles in it took 0.13 s of a start.
    # `load_kernels` enables the collector again.
    gc.disable()
    sys.exit(command_line(sys.argv[1:] if arguments is None else arguments))


def command_line(arguments: Sequence[str]) -> int:
    """Run the command that the arguments name, and return the exit code.

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
    prepared: "PreparedRun",
    options: "RunOptions",
    plotter: Plotter,
    *,
    at_most_real_time: bool = False,
) -> "Summary":
    """Do the run, with a progress bar on a terminal."""
    from scalpel_sim.output.run_folder import Outputs
    from scalpel_sim.run import perform, run_time

    seconds = run_time(prepared.simulation, prepared.scene.seconds)
    with progress(seconds, options.printing) as advance:
        return perform(
            prepared.simulation,
            Outputs(prepared.folder, plotter, prepared.simulation.recording.columns),
            # A server does not say how its tissue is held, nor how it is solved.
            scene=prepared.scene if options.client.connect is None else None,
            views=prepared.scene.views,
            settings=prepared.settings,
            seconds=seconds,
            every_frame=_paced(advance) if at_most_real_time else advance,
            exports=options.output.export,
        )


def _paced(after_frame: Callable[["Simulation"], None]) -> Callable[["Simulation"], None]:
    """Return `after_frame` followed by a pause where simulated time is ahead of the wall clock."""
    start = time.monotonic()

    def pause(simulation: "Simulation") -> None:
        after_frame(simulation)
        ahead = simulation.time - (time.monotonic() - start)
        if ahead > SHORTEST_PAUSE:
            time.sleep(ahead)

    return pause


def _wait_for_start(url: str) -> None:
    """Print where the page is; at a terminal, wait until it has been opened."""
    if sys.stdin is not None and sys.stdin.isatty():
        say(f"open {url}, then press Enter to begin")
        sys.stdin.readline()
    else:
        say(f"live at {url}")


def _stay_while(condition: Callable[[], bool], message: str) -> None:
    """Print a message, and return when the condition fails, or on Ctrl-C."""
    with StopSignals() as stop:
        say(message)  # from now on Ctrl-C ends it without a traceback
        while condition() and stop.reason is None:
            time.sleep(SECONDS_PER_CHECK)
