"""A disk of a few megabytes, in memory, which a run can fill: a namespace of its own mounts it."""

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.processes import environment

NAMESPACE = ("unshare", "--map-root-user", "--mount", "sh", "-c")


@pytest.fixture(scope="session")
def small_disks() -> None:
    """Skip the test if the system does not let this process mount a small disk."""
    try:
        done = subprocess.run(
            [*NAMESPACE, "mount -t tmpfs none /mnt"], capture_output=True, timeout=30
        )
    except OSError:
        done = None
    if done is None or done.returncode != 0:
        pytest.skip("no right to mount a small disk")


def run_on_a_full_disk(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    """Run `scalpel-sim` on a full disk, which holds a folder's files at /mnt, and copy them back.

    Args:
        words: What follows `scalpel-sim`.
        folder: The folder.
    """
    script = f"""
        mount -t tmpfs -o size=1M none /mnt || exit 99
        cp -a {shlex.quote(str(folder))}/. /mnt
        dd if=/dev/zero of=/mnt/filler bs=4k 2>/dev/null
        {shlex.join([sys.executable, "-m", "scalpel_sim", *words])}
        code=$?
        rm /mnt/filler
        cp -a /mnt/. {shlex.quote(str(folder))}
        exit $code
    """
    return subprocess.run(
        [*NAMESPACE, script], capture_output=True, text=True, env=environment(), timeout=300
    )


def run_on_a_small_disk(
    *words: str, megabytes: float, copy_to: Path, filled_after: float | None = None
) -> subprocess.CompletedProcess[str]:
    """Run `scalpel-sim` with its folder on a small disk, and copy what it left to a folder.

    Args:
        words: What follows `scalpel-sim`, without --out.
        megabytes: Size of the disk.
        copy_to: Where the files go afterwards.
        filled_after: When another program fills the disk [s]; None: never.
    """
    run = shlex.join([sys.executable, "-m", "scalpel_sim", *words, "--out", "/mnt/run"])
    fill = "" if filled_after is None else (
        f"(sleep {filled_after}; dd if=/dev/zero of=/mnt/filler bs=4k 2>/dev/null) &"
    )  # fmt: skip
    script = f"""
        mount -t tmpfs -o size={int(megabytes * 1e6)} none /mnt || exit 99
        {fill}
        {run}
        code=$?
        wait
        test ! -d /mnt/run || cp -a /mnt/run/. {shlex.quote(str(copy_to))}
        exit $code
    """
    return subprocess.run(
        [*NAMESPACE, script], capture_output=True, text=True, env=environment(), timeout=300
    )
