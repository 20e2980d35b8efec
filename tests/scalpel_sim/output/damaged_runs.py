"""Runs that were killed, and ways to damage their files."""

import shutil
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from scalpel_sim.cli.options import ArmOptions, TissueOptions
from scalpel_sim.cli.resumed_run import perform_resumed
from scalpel_sim.cli.run_setup import RunOptions, prepared_run
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.runs.checkpoints import Checkpoints, read_checkpoint
from scalpel_sim.runs.file_names import CHECKPOINT_FILES
from scalpel_sim.runs.options import ClientOptions, PrintOptions, RunOutputOptions
from scalpel_sim.runs.prepared_run import perform_script
from tests.scalpel_sim.output.killed_runs import Killed, at

AGAIN = RunOptions(
    TissueOptions(),
    ArmOptions(),
    ClientOptions(),
    RunOutputOptions(checkpoint=0.04),
    PrintOptions(quiet=True),
)
"""Options of a run that goes on."""


def run_in(folder, n_frames=None, **arm):
    """Do a run as the command does, which is killed after so many frames, if after any."""
    output = replace(AGAIN.output, out=folder)
    asked = AGAIN._replace(arm=ArmOptions(seconds=0.25, **arm), output=output)
    with Plotter() as plotter, prepared_run("grid2", asked, audits=True) as prepared:
        perform_script(prepared, plotter, at(n_frames))


def killed_in(folder):
    """Do a run that is killed after frame 233: of checkpoint 200 and 160, and with 225 rows."""
    is_due = Checkpoints.is_due

    def is_due_when_written(checkpoints, n_frames):
        checkpoints.finish()  # a slow disk has no part in which checkpoints there are
        return is_due(checkpoints, n_frames)

    with pytest.MonkeyPatch.context() as patch, pytest.raises(Killed):
        patch.setattr(Checkpoints, "is_due", is_due_when_written)
        run_in(folder, 233)


@contextmanager
def resuming() -> Iterator[Callable]:
    """Yield a function that goes on with the run in a folder, as the command does."""
    loading = deque([Plotter()])  # one ahead: loading takes longer than these runs

    def resume(folder):
        loading.append(Plotter())
        with loading.popleft() as plotter:
            return perform_resumed(folder, AGAIN, plotter)

    try:
        yield resume
    finally:
        loading.pop().close()


def copied(source, target):
    shutil.copytree(source, target)
    return target


def checkpoints(folder):
    """Return the paths of the checkpoints, the last one first."""
    paths = [folder / name for name in CHECKPOINT_FILES]
    return sorted(paths, key=lambda path: -read_checkpoint(path).head.mark.n_frames)


def change(path, damage):
    path.write_bytes(damage(path.read_bytes()))


def with_bits(n, seed=0):
    """Return what turns over so many bits of the first half."""

    def damage(data):
        bits = np.unpackbits(np.frombuffer(data, np.uint8))
        bits[np.random.default_rng(seed).choice(4 * len(data), n, replace=False)] ^= 1
        return np.packbits(bits).tobytes()

    return damage


def with_noise(n):
    """Return what replaces so many bytes in the first half."""
    noise = np.random.default_rng(1).bytes(n)
    return lambda data: data[: len(data) // 4] + noise + data[len(data) // 4 + n :]


def with_cell(row, column, text):
    """Return what writes a number into a row of a table."""

    def damage(data):
        lines = data.decode().splitlines(keepends=True)
        cells = lines[row].rstrip("\n").split(",")
        cells[shared_columns().index(column)] = text
        lines[row] = ",".join(cells) + "\n"
        return "".join(lines).encode()

    return damage


def with_rows(change_rows):
    """Return what changes the list of lines."""
    return lambda data: b"".join(change_rows(data.splitlines(keepends=True)))


def half(data):
    return data[: len(data) // 2]


def nothing(data):
    return b""


def damaged_at_random(folder, seed):
    """Damage one to three files of a run in some way."""
    rng = np.random.default_rng(seed)
    names = sorted(path.name for path in folder.iterdir() if path.stat().st_size)
    for name in rng.choice(names, rng.integers(1, 4), replace=False):
        data = (folder / name).read_bytes()
        begin, end = np.sort(rng.integers(0, len(data) + 1, 2))
        end = min(end, begin + rng.choice([1, 40, len(data)]))
        damaged = (
            with_bits(rng.integers(1, 100), seed)(data),
            data[:begin] + rng.bytes(end - begin) + data[end:],
            data[:begin] + data[end:],
            data[:end] + data[begin:],
            data[:begin],
        )
        (folder / name).write_bytes(damaged[rng.integers(len(damaged))])
