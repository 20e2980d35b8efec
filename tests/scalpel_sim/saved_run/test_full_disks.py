"""A recording on a disk that gets full has the steps that there was room for, and says so."""

import re
import shlex
import subprocess
import sys

import h5py
import numpy as np
import pytest

from scalpel_sim import SavedRun
from tests.support.processes import environment
from tests.support.small_disk import NAMESPACE

pytestmark = pytest.mark.usefixtures("small_disks")


def recorded_on(folder, kilobytes, seconds, before="true"):
    """Record a run on a small disk, and copy the file to a folder."""
    words = ("run", "slab", "--seconds", str(seconds), "--out", str(folder / "out"))
    script = f"""
        mount -t tmpfs -o size={kilobytes}k none /mnt || exit 99
        {before}
        {shlex.join([sys.executable, "-m", "scalpel_sim", *words])} --record /mnt/run.vtkhdf
        code=$?
        ls -A /mnt >{folder}/names
        test ! -f /mnt/run.vtkhdf || cp /mnt/run.vtkhdf {folder}
        exit $code
    """
    return subprocess.run(
        [*NAMESPACE, script], capture_output=True, text=True, env=environment(), timeout=300
    )


def test_a_disk_that_is_full_is_said_before_the_first_frame(tmp_path):
    filled = "dd if=/dev/zero of=/mnt/filler bs=4k 2>/dev/null"
    done = recorded_on(tmp_path, 1024, 0.3, filled)
    assert done.returncode == 1
    assert re.fullmatch(
        r"error: /mnt/run\.vtkhdf: cannot be written \(No space left on device\); choose another "
        r"--record\n",
        done.stderr,
    )
    assert (tmp_path / "names").read_text().split() == ["filler"]


def test_where_the_disk_gets_full_the_steps_before_stay(tmp_path):
    done = recorded_on(tmp_path, 900, 1.0)
    assert done.returncode == 1
    said = re.search(
        r"after (0\.\d+) s: /mnt/run\.vtkhdf: cannot be written \(No space", done.stderr
    )
    with SavedRun(tmp_path / "run.vtkhdf") as run:
        assert 0.0 <= float(said[1]) + 0.001 - run.times[-1] <= 0.0401
        assert run.step(-1).snapshot.positions.any()
    assert (tmp_path / "names").read_text().split() == ["run.vtkhdf"]


def test_a_recording_without_room_for_a_second_one_keeps_its_holes(tmp_path):
    done = recorded_on(tmp_path, 1400, 0.3)  # it takes some 1,000 while it grows, 1,760 twice
    assert done.returncode == 0
    assert "run.vtkhdf: is complete, but cannot be written anew" in done.stderr
    with SavedRun(tmp_path / "run.vtkhdf") as run:
        assert run.times[-1] == 0.3 and len(run.rows) == 300
    assert (tmp_path / "names").read_text().split() == ["run.vtkhdf"]


COPIED = """
import os, sys, time
from pathlib import Path
import numpy as np
from scalpel_sim.saved_run.growing_tables import GrowingTables
from scalpel_sim.saved_run.preallocated_file import STEP_TIMES, GrowingTable

MEGABYTE = np.ones((1 << 18, 1), "f4")
kinds = GrowingTable(STEP_TIMES, "f8", (), 99), GrowingTable("own/numbers", "f4", (1,), 9 << 18)
tables = GrowingTables(Path("/mnt/run.vtkhdf"), kinds, lambda file: None)
for i in range(6):
    tables.append("own/numbers", MEGABYTE)
tables.append(STEP_TIMES, 0.0)
tables.commit()  # from here on a larger file is made
while os.statvfs("/mnt").f_bavail * 4096 > 3 << 20:
    time.sleep(0.001)
for i in range(3):
    tables.append("own/numbers", MEGABYTE)
tables.append(STEP_TIMES, 1.0)
tables.commit()
tables.close()
assert os.listdir("/mnt") == ["run.vtkhdf"]
os.execvp("cp", ["cp", "/mnt/run.vtkhdf", sys.argv[1]])
"""


def test_a_larger_file_that_is_made_meanwhile_takes_no_space_from_a_step(tmp_path):
    copied = shlex.join([sys.executable, "-c", COPIED, str(tmp_path)])
    script = f"mount -t tmpfs -o size=14M none /mnt || exit 99; {copied}"
    done = subprocess.run([*NAMESPACE, script], capture_output=True, text=True, env=environment())
    assert done.returncode == 0, done.stderr
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        assert file["VTKHDF/Steps/Values"][:].tolist() == [0.0, 1.0]
        assert np.all(file["own/numbers"][:] == 1.0) and len(file["own/numbers"]) == 9 << 18
