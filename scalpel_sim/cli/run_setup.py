"""From the command line's options to a run that only has to be started."""

import logging
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from bridge import InProcessLink, TcpLink, TissueLink, chosen_key
from scalpel_sim.cli.options import (
    ArmOptions,
    MaterialOptions,
    TissueOptions,
    expect_no_options,
    given_options,
)
from scalpel_sim.cli.scene_options import chosen_scene, led_elsewhere, scene_in_file
from scalpel_sim.errors import Interrupted, RunError, UsageError
from scalpel_sim.output.export import check_exports, check_file
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.output.summary import Summary
from scalpel_sim.preparation.prepare import prepare
from scalpel_sim.preparation.tissue import check_scene, make_tissue
from scalpel_sim.runs.checkpoints import CHECKPOINT_SECONDS
from scalpel_sim.runs.console import print_report
from scalpel_sim.runs.file_names import SCENE
from scalpel_sim.runs.options import SERVER_PATIENCE, ClientOptions, OutputOptions, PrintOptions
from scalpel_sim.runs.prepared_run import PreparedRun, load_kernels
from scalpel_sim.runs.resumption import Resumption, resumption_of
from scalpel_sim.runs.run import perform
from scalpel_sim.runs.run_folder import check_folder
from scalpel_sim.saved_run.layout import VTKHDF_SUFFIX
from scalpel_sim.scene.checks import LONGEST_RUN
from scalpel_sim.scene.read import read_scene
from scalpel_sim.scene.scene import Scene, changed
from scalpel_sim.scene.served import scene_of
from scalpel_sim.scene.task_table import TaskTable
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.kind import StrokeTable
from scalpel_sim.tables.text_files import is_toml_file
from tissue import MANY_SUBSTEPS, MOST_SUBSTEPS
from tissue.support import whole_file

_log = logging.getLogger("scalpel_sim")

_UNKNOWN_TO_CLIENT = frozenset(
    {
        "bodies",
        "fixed",
        "stretch",
        "gravity",
        "floor",
        "cut",
        "scheme",
        "relaxation",
        "mass_scaling",
        "element",
        "precision",
        "threads",
        "blade",
        "audit",
        "attachments",
        "cores",
        "labels",
        "supports",
    }
)
"""Settings of a scene that a server knows and does not send."""


class RunOptions(NamedTuple):
    """Requests of the command line, group by group."""

    tissue: TissueOptions
    arm: ArmOptions
    client: ClientOptions
    output: OutputOptions
    printing: PrintOptions


@contextmanager
def prepared_run(
    name: str | None,
    options: RunOptions,
    *,
    audits: bool = False,
    relaxation: str | None = None,
    is_led: bool = False,
    strokes: Sequence[StrokeTable] = (),
) -> Iterator[PreparedRun]:
    """Yield the run that the command line requests, and close the link to the tissue afterwards.

    Args:
        name: The scene; None for the default one.
        options: What the command line requests.
        audits: Whether an account of the energy is kept where nothing is said of it.
        relaxation: How the motion is advanced where nothing is said of it, and the tissue does not
            stiffen; None: as the scene has it.
        is_led: Whether a hand will lead the blade.
        strokes: Strokes in place of those of the scene, where there are any; the tissue is here.

    Raises:
        UsageError: options that make no sense, or not together.
        LinkError: the tissue is elsewhere, and cannot be reached.
        Interrupted: a signal came before it was prepared.
    """
    client = options.client
    with Plotter() as plotter, ExitStack() as stack:  # it loads while the run is prepared
        try:
            if client.key is not None and client.connect is None:
                raise UsageError(
                    "--key is for a tissue elsewhere; add --connect HOST:PORT, or omit it"
                )
            check_exports(options.output.export)
            if options.output.record is not None:
                check_file(options.output.record, VTKHDF_SUFFIX, "--record")
            checkpoint_seconds = _checkpoint_seconds(options)
            if client.connect is None:
                asked = chosen_scene(
                    name, options.tissue, options.arm, relaxation=relaxation, audits=audits
                )
                if strokes:
                    task = asked.task or TaskTable()  # the plan and the strokes are one thing
                    asked = changed(asked, strokes=tuple(strokes), seconds=None, task=task)
                link, scene, settings = _tissue_here(asked, options)
            else:
                link, scene, settings = _tissue_elsewhere(name, options, client.connect)
            stack.callback(link.close)
            simulation = prepare(scene, link, is_led=is_led)
            check_steps_of_frames(simulation)
        except KeyboardInterrupt as error:
            raise Interrupted(f"{error} before the run began; no file was written") from error
        yield PreparedRun(
            simulation,
            scene,
            _folder(options.output, scene),
            settings | {"arm": simulation.arm.name},
            plotter,
            checkpoint_seconds,
            options.output.export,
            options.output.record,
            client.connect is None,
            options.printing,
        )


def _tissue_here(scene: Scene, options: RunOptions) -> tuple[TissueLink, Scene, dict[str, Any]]:
    """Make the tissue in this process, after all checks that need none."""
    check_scene(scene)
    check_folder(_folder(options.output, scene))
    scene, springs = springs_as_asked(scene, options.tissue.material)
    load_kernels(options.printing, scene)
    _log.info("settling %s", scene.about)
    return InProcessLink(make_tissue(scene), scene.name), scene, scene.settings() | springs


def _tissue_elsewhere(
    name: str | None, options: RunOptions, address: str
) -> tuple[TissueLink, Scene, dict[str, Any]]:
    """Connect to the tissue in another process, and make a scene from what its server describes."""
    tissue = options.tissue
    for option in given_options(tissue):
        raise UsageError(
            f"--{option} belongs to the tissue, and that is at {address}; give it to "
            "`scalpel-sim serve`"
        )
    given = scene_in_file(name) if name is not None and is_toml_file(name) else None
    link = TcpLink(address, key=chosen_key(options.client.key), patience=SERVER_PATIENCE)
    try:
        scene = led_elsewhere(scene_of(link, given), options.arm)
        if given is None and name not in (None, scene.name):
            raise UsageError(f"{address} holds '{scene.name}', not '{name}'")
        check_folder(_folder(options.output, scene))
    except BaseException:
        link.close()
        raise
    settings = {
        key: value for key, value in scene.settings().items() if key not in _UNKNOWN_TO_CLIENT
    }
    return link, scene, settings | {"connect": address}


def perform_resumed(folder: Path, options: RunOptions) -> Summary:
    """Continue a run; print and return its summary.

    A run that a hand led continues with what the hand did until it was killed, and then rests.

    Args:
        folder: The folder of its files.
        options: What the command line requests.

    Raises:
        UsageError: there is no such run, it is complete, or an option does not go with it.
        StateError: this is another version of the program, or something that the run reads, such as
            its mesh, is another one now.
        Interrupted: the user or the system ended the run.
        RunError: another run writes there, or the run failed.
        OSError: a file cannot be read.
    """
    given = (options.tissue, options.arm, options.client)
    expect_no_options(given, "--resume, which continues the run with what was requested")
    if options.output.out is not None:
        raise UsageError("--out is given with --resume, which writes to its folder; omit --out")
    if folder.is_dir():
        check_folder(folder)  # no run writes there
    resumption = resumption_of(folder)
    resumption.put_back_scene(folder)
    if resumption.seconds is None:
        _end_records(folder, resumption)
    exports = options.output.export
    if resumption.plan is not None and not exports:
        exports = tuple(map(Path, resumption.plan.exports))
    record = options.output.record
    if record is None and resumption.plan is not None and resumption.plan.record is not None:
        record = Path(resumption.plan.record)
    output = replace(options.output, out=folder, export=exports, record=record)
    options = options._replace(output=output)
    with prepared_run(str(folder / SCENE), options, audits=True) as prepared:
        summary = perform(prepared, resumption=resumption)
        print_report(summary, prepared)
        return summary


def _end_records(folder: Path, resumption: Resumption) -> None:
    """End the records of a hand, if one led the run."""
    plan, last = resumption.plan, resumption.last
    t_end = 0.0 if plan is None or last is None else last.n_frames * plan.dt
    for path in read_scene(folder / SCENE).recorded_files:
        if path.parent.resolve() != folder.resolve():
            continue
        done = None if last is None else last.written.get(path.name)
        try:
            end_record(path, t_end, None if done is None else done.n_bytes)
        except (OSError, ValueError) as error:
            raise RunError(
                f"{path}: what the hand did cannot be read ({error}), and the run cannot continue"
            ) from error


def end_record(path: Path, t_end: float, n_bytes: int | None = None) -> None:
    """Cut off a last line that is not whole, and extend the last pose to a time.

    Until then the hand rested, or there would be another row.

    Args:
        path: `stroke.csv`, or the file of a grasper.
        t_end: Simulated time [s].
        n_bytes: How much of it is kept [bytes]; None: all.

    Raises:
        OSError: the file cannot be read or written.
    """
    text = path.read_bytes()[:n_bytes].decode("ascii")
    lines = [line for line in text.splitlines(True) if line.endswith("\n")]
    if len(lines) > 1:
        last, _, pose = lines[-1].partition(",")
        if float(last) < t_end:
            lines.append(f"{t_end!r},{pose}")
    with whole_file(path) as unfinished:
        unfinished.write_text("".join(lines), "ascii")


def springs_as_asked(scene: Scene, options: MaterialOptions) -> tuple[Scene, dict[str, Any]]:
    """Return the scene, calibrated on request, and a report on its springs for the summary.

    Raises:
        UsageError: the scene's law has no springs.
        ValueError: no stiffness of the springs gives the Young's modulus that is requested.
    """
    if not (options.calibrate or options.spring_error):
        return scene, {}
    if not scene.material.law.has_springs:
        option = "--calibrate" if options.calibrate else "--spring-error"
        raise UsageError(
            f"{option} is about law springs; law {scene.material.law.name} is as stiff as "
            "requested on any mesh. Add --law springs, or omit it"
        )
    from tissue import calibrated, spring_error

    mesh = scene.mesh()
    if options.calibrate:
        scene = changed(scene, material=calibrated(mesh, scene.material))
    error = spring_error(mesh, scene.material)
    return scene, {
        "springs": {
            "young_modulus_pa": error.relaxed.young_modulus,
            "young_modulus_error": error.young_modulus_error,
            "young_modulus_softest_pa": error.softest,
            "young_modulus_stiffest_pa": error.stiffest,
            "poisson_ratio": error.relaxed.poisson_ratio,
            "calibration": scene.material.as_keys()["spring_calibration"],
        }
    }


def check_steps_of_frames(simulation: Simulation) -> None:
    """Refuse frames that take so many Runge-Kutta steps that nothing can end one; warn of many.

    Raises:
        UsageError: a frame takes more than `MOST_SUBSTEPS`.
    """
    measures = simulation.link.cut_report().now
    n_steps = simulation.dt / measures.time_step
    if n_steps <= MANY_SUBSTEPS:
        return
    reason = "elements are small, stiff or light"
    remedy = "Check --scale, or lower --young, or raise --density"
    if measures.undamped_steps(simulation.dt) <= MANY_SUBSTEPS:
        reason = "damping is strong"
        remedy = "Lower viscous_damping or retardation_time of its [material]"
    found = f"a frame takes {n_steps:.4g} Runge-Kutta steps, because the tissue's {reason}"
    if n_steps > MOST_SUBSTEPS:
        raise UsageError(f"{found}; at most {MOST_SUBSTEPS:,} are done. {remedy}")
    _log.warning("%s: the run will take long. %s", found, remedy)


def _checkpoint_seconds(options: RunOptions) -> float:
    """Return the simulated time between two checkpoints [s]; 0: there are none.

    Raises:
        UsageError: it is no time, or longer than any run, or the tissue is elsewhere.
    """
    asked, is_here = options.output.checkpoint, options.client.connect is None
    if asked is None:
        return CHECKPOINT_SECONDS if is_here else 0.0
    if not 0.0 <= asked <= LONGEST_RUN:
        raise UsageError(
            f"--checkpoint is {asked}; it must be a time of at most {LONGEST_RUN:g} s, or 0 for "
            "none"
        )
    if asked > 0.0 and not is_here:
        raise UsageError(
            "--checkpoint is for a tissue in this process, and --connect has it elsewhere; omit "
            "one of them"
        )
    return asked


def _folder(output: OutputOptions, scene: Scene) -> Path:
    """Return the folder of the files."""
    return output.out or Path("out") / scene.name
