"""Runs that are killed, whose files are damaged, that go on, and are compared with whole ones."""

import gc
import json
import shutil
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest

from scalpel_sim import SCENES, prepare
from scalpel_sim.cli.options import ArmOptions, TissueOptions
from scalpel_sim.cli.run_setup import RunOptions, perform_resumed, prepared_run
from scalpel_sim.hands.teleoperation import LiveHand
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.recording.columns import shared_columns
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.checkpoints import Checkpoints, read_checkpoint
from scalpel_sim.runs.file_names import CHECKPOINT_FILES
from scalpel_sim.runs.options import ClientOptions, PrintOptions, RunOutputOptions
from scalpel_sim.runs.prepared_run import PreparedRun
from scalpel_sim.runs.resumption import resumption_of
from scalpel_sim.runs.run import perform
from scalpel_sim.scene.read import read_scene
from tests.scalpel_sim.hands.driven_runs import controls_of, through_the_body
from tests.support.run_files import untimed

EVERY = 0.1
"""Simulated time between two checkpoints [s]."""

WALL = ("wall_seconds", "real_time_factor", "frame_rate_median", "frame_rate_p99", "share")
"""Figures of a summary that differ from run to run."""


AGAIN = RunOptions(
    TissueOptions(),
    ArmOptions(),
    ClientOptions(),
    RunOutputOptions(checkpoint=0.04),
    PrintOptions(quiet=True),
)
"""Options of a run that goes on."""


class Killed(BaseException):
    """End of a run at once, as by a kill."""


def at(n_frames):
    """Return a callback that ends a run after so many frames."""

    def kill(simulation):
        if len(simulation.recording) == n_frames:
            raise Killed

    return kill


def perform_in(folder, scene, simulation=None, resumption=None, record=None, **others):
    """Do a run in a folder, and record it to a file."""
    simulation, settings = simulation or prepare(scene), {"scene": scene.name}
    with Plotter() as plotter:
        prepared = PreparedRun(simulation, scene, folder, settings, plotter, EVERY, record=record)
        return perform(prepared, resumption=resumption, **others)


def kill_in(folder, scene, n_frames, **others):
    """Do a run that is killed after so many frames."""
    with pytest.raises(Killed):
        perform_in(folder, scene, every_frame=at(n_frames), **others)
    gc.collect()  # a process that is killed holds no lock


def resume_in(folder, **others):
    """Go on with a run in a folder."""
    return perform_in(
        folder, read_scene(folder / "scene.toml"), None, resumption_of(folder), **others
    )


def physics(folder):
    """Return the columns of `forces.csv` but wall times."""
    return untimed(read_forces(folder / "forces.csv"))


def figures(folder):
    """Return the figures of `summary.json` but wall times."""
    summary = json.loads((folder / "summary.json").read_text())
    return {key: value for key, value in summary.items() if key not in WALL}


def expect_same(folder, whole):
    """Compare the files of two runs."""
    assert np.array_equal(physics(folder), physics(whole), equal_nan=True)
    assert figures(folder) == figures(whole)
    for name in ("initial.vtu", "final.vtu", "scene.toml", "replay.html"):
        assert (folder / name).read_bytes() == (whole / name).read_bytes(), name


def led(folder, n_frames, *commands):
    """Do a run that a hand leads, and that is killed; what it does is drawn from a seed.

    Args:
        folder: Where its files go.
        n_frames: Frames after which it is killed.
        commands: Commands of a page, each after the number of frames after which it comes.
    """
    scene = SCENES["grid2"]
    simulation = prepare(scene, is_led=True)
    hand = LiveHand(simulation, seconds=10.0, clock=lambda: 0.0)
    controls = controls_of(simulation, hand)
    lead, kill, later = through_the_body(hand), at(n_frames), deque(commands)

    def after_frame(now):
        lead(now)
        if later and later[0][0] == len(now.recording):
            controls.commands.append(later.popleft()[1])
        kill(now)

    with pytest.raises(Killed):
        perform_in(folder, scene, simulation, every_frame=after_frame, controls=controls)


def run_in(folder, n_frames=None, **arm):
    """Do a run as the command does, which is killed after so many frames, if after any."""
    output = replace(AGAIN.output, out=folder)
    asked = AGAIN._replace(arm=ArmOptions(seconds=0.25, **arm), output=output)
    with prepared_run("grid2", asked, audits=True) as prepared:
        perform(prepared, every_frame=at(n_frames))


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

    def loaded():
        loading.append(Plotter())
        return loading.popleft()

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("scalpel_sim.cli.run_setup.Plotter", loaded)
        yield lambda folder: perform_resumed(folder, AGAIN)
        loading.pop().close()


def copied(source, target):
    shutil.copytree(source, target)
    return target


def checkpoints(folder):
    """Return the paths of the checkpoints, the last one first."""
    paths = [folder / name for name in CHECKPOINT_FILES]
    return sorted(paths, key=lambda path: -read_checkpoint(path).mark.n_frames)


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
