"""The command line: `scalpel-sim run`, `view`, `serve`, `bench`, `validate`, and the others."""

import traceback
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import App, CycloptsError, Parameter

from bridge import DEFAULT_HOST, DEFAULT_PORT
from scalpel_sim.cli.check_command import check
from scalpel_sim.cli.crtk_command import crtk
from scalpel_sim.cli.dataset_command import dataset
from scalpel_sim.cli.doctor_command import doctor
from scalpel_sim.cli.explain_command import explain
from scalpel_sim.cli.film_command import film
from scalpel_sim.cli.mesh_command import mesh
from scalpel_sim.cli.new_command import new
from scalpel_sim.cli.options import (
    ArmOptions,
    SceneName,
    TissueOptions,
    expect_no_options,
)
from scalpel_sim.cli.recording_commands import export, replay
from scalpel_sim.cli.snapshot_command import snapshot
from scalpel_sim.cli.spacemouse_command import spacemouse
from scalpel_sim.cli.trace_command import cut_along_pixels
from scalpel_sim.cli.validate_command import perform_case, validate
from scalpel_sim.cli.view_command import view
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
from scalpel_sim.runs.console import (
    expect_no_warnings,
    log_to_stderr,
    print_report,
    say,
    say_error,
)
from scalpel_sim.runs.options import (
    CONNECTION,
    DEVICE,
    OUTPUT,
    ClientOptions,
    DeviceOptions,
    Flag,
    PrintOptions,
    RunOutputOptions,
)
from scalpel_sim.runs.stop_signals import raised_signal
from scalpel_sim.validate.speed.command import bench
from scalpel_sim.version import version

PROGRAM = "scalpel-sim"

app = App(
    name=PROGRAM,
    version=version,
    suppress_keyboard_interrupt=False,  # `command_line` says what happened
    help="A MuJoCo robot arm holds a scalpel, cuts soft tissue for real, and feels it.\n\n"
    "Exit codes: 0 done, 1 the run failed or was interrupted, 2 wrong use or bad input, 3 a "
    "check of a validation failed, 4 a run with --strict ended with warnings.",
)


@app.command(name="run")
def _run(
    scene: SceneName = None,
    /,
    *,
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    client: ClientOptions = ClientOptions(),
    hand: Annotated[Literal["script", "device"], Parameter(group=DEVICE)] = "script",
    device: DeviceOptions = DeviceOptions(),
    output: RunOutputOptions = RunOutputOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Cut a body with the arm, print a table, and write files to a folder.

    A FILE.toml that is a case (docs/scenes.md) is run as `validate --case` does: its records are
    compared with what it expects, and the exit code is 3 where that is missed.

    For example:

    ```console
    scalpel-sim run
    scalpel-sim run slab --stroke curved --toughness 10
    scalpel-sim run organ --material liver --blade-thickness 0.001 --out out/liver
    scalpel-sim run --mesh organ.msh --scale 0.001 --fix bottom --material mine.toml
    scalpel-sim run docs/examples/tension.toml
    scalpel-sim run --hand device --listen 127.0.0.1:8767
    scalpel-sim run --resume out/organ
    ```

    Args:
        hand: Who leads the blade: script, the strokes of the scene; or device, a program that
            connects, at real-time speed. The motion is then advanced by --relaxation verlet, unless
            you choose another or the tissue stiffens.
    """
    with log_to_stderr(printing):
        from scalpel_sim.cli.run_setup import RunOptions, perform_resumed, prepared_run
        from scalpel_sim.runs.device_run import check_device_options, device_run, perform_device
        from scalpel_sim.runs.run import perform
        from scalpel_sim.scene.case import is_case
        from scalpel_sim.tables.text_files import is_toml_file

        options = RunOptions(tissue, arm, client, output, printing)
        is_led = hand == "device"
        check_device_options(device, is_led=is_led)
        if output.resume is not None:
            if scene is not None or is_led:
                raise UsageError(
                    "--resume continues the run in its folder; omit the scene and --hand"
                )
            return expect_no_warnings(perform_resumed(output.resume, options), output)
        if scene is not None and is_toml_file(scene) and is_case(Path(scene)):
            expect_no_options(
                (tissue, arm, client, replace(output, out=None)),
                f"the case {scene}, which has all that it does",
            )
            if is_led:
                raise UsageError("--hand is for a scene, and this is a case; omit it")
            return perform_case(Path(scene), output.out, printing)
        relaxation = "verlet" if is_led else None
        with prepared_run(
            scene, options, audits=not is_led, relaxation=relaxation, is_led=is_led
        ) as prepared:
            if is_led:
                with device_run(prepared, device) as led:
                    summary = perform_device(prepared, led)
            else:
                summary = perform(prepared)
            print_report(summary, prepared)
        expect_no_warnings(summary, output)


app.command(view)
app.command(snapshot)
app.command(film)
app.command(cut_along_pixels, name="trace")
app.command(replay)
app.command(export)
app.command(dataset)
app.command(explain)
app.command(spacemouse)
app.command(crtk)


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
    from scalpel_sim.cli.run_setup import springs_as_asked
    from scalpel_sim.cli.scene_options import chosen_scene
    from scalpel_sim.preparation.tissue import check_scene, make_tissue
    from scalpel_sim.runs.prepared_run import load_kernels
    from scalpel_sim.scene.served import sent_views

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
app.command(check)
app.command(doctor)
app.command(bench)
app.command(figure)
app.command(new)
app.command(mesh)
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
        from scalpel_sim.cli.materials import (
            chosen_presets,
            presets_as_json,
            print_presets,
            write_template,
        )

        if write is not None:
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
    except KeyboardInterrupt as error:
        say_error(str(error) or "interrupted")
        return EXIT_RUN_FAILED
    except Exception as error:
        if verbose:
            traceback.print_exc()
        # An extension that is interrupted while it is loaded says that it cannot be loaded.
        is_cause = isinstance(error, ImportError) and raised_signal() is not None
        say_error(str(raised_signal()) if is_cause else one_line(error))
        return exit_code(error)
    return EXIT_OK
