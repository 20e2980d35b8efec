"""Goes on with a run that was interrupted, as `run --resume FOLDER` asks for it."""

from dataclasses import replace
from pathlib import Path

from scalpel_sim.cli.options import expect_no_options
from scalpel_sim.cli.run_setup import RunOptions, prepared_run
from scalpel_sim.errors import RunError, UsageError
from scalpel_sim.output.summary import Summary
from scalpel_sim.runs.file_names import SCENE
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.resumption import Resumption, resumption_of
from scalpel_sim.runs.run import perform
from scalpel_sim.runs.run_folder import check_folder
from scalpel_sim.scene.read import read_scene
from tissue.support import whole_file


def perform_resumed(folder: Path, options: RunOptions) -> tuple[Summary, PreparedRun]:
    """Go on with a run, and return its summary and what it was.

    A run that a hand led goes on with what the hand did until it was killed, and then rests.

    Args:
        folder: The folder of its files.
        options: What the command line asks for.

    Raises:
        UsageError: there is no such run, it is complete, or an option does not go with it.
        StateError: this is another version of the program, or something that the run reads, such as
            its mesh, is another one now.
        Interrupted: the user or the system ended the run.
        RunError: another run writes there, or the run failed.
        OSError: a file cannot be read.
    """
    given = (options.tissue, options.arm, options.client)
    expect_no_options(given, "--resume, which goes on with what the run was asked for")
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
    options = options._replace(output=replace(options.output, out=folder, export=exports))
    with prepared_run(str(folder / SCENE), options, audits=True) as prepared:
        return perform(prepared, resumption=resumption), prepared


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
                f"{path}: what the hand did cannot be read ({error}), and the run cannot go on"
            ) from error


def end_record(path: Path, t_end: float, n_bytes: int | None = None) -> None:
    """Cut off a last line that is not whole, and have the last pose last until a time.

    Until then the hand rested, or it would have left another row.

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
