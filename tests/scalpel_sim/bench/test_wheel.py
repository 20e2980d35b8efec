"""The peers run from an installed wheel, not only from a clone of the repository."""

import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from scalpel_sim.bench.peer_benchmark import body_file
from scalpel_sim.bench.peer_cases import OURS, PEERS
from tissue import block

REPOSITORY = Path(__file__).parents[3]

ONE_TURN = """
import sys
from pathlib import Path
from scalpel_sim.bench.peer_process import PeerProcess
import scalpel_sim
adapter, case, body = sys.argv[1:]
process = PeerProcess(adapter, case, Path(body), Path(sys.executable), 0)
turn = process.turn(0.001)
process.close()
print(scalpel_sim.__file__, len(turn.seconds), turn.moved)
"""


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    """The files of a wheel of these sources."""
    uv = shutil.which("uv")
    if uv is None:
        pytest.skip("uv, which builds the wheel, is not on the PATH")
    folder = tmp_path_factory.mktemp("wheel")
    built = subprocess.run(
        [uv, "build", "--wheel", "-o", folder], cwd=REPOSITORY, capture_output=True, text=True
    )
    if built.returncode != 0 and "fetch" in built.stderr:
        pytest.skip("the build backend cannot be fetched")
    assert built.returncode == 0, built.stderr
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as files:
        files.extractall(folder / "site")
    return folder / "site"


def test_the_wheel_holds_the_adapter_of_every_case(unpacked):
    folder = unpacked / "scalpel_sim" / "bench" / "peers"
    files = {path.name for path in folder.iterdir()}
    adapters = {f"{case.adapter}.py" for case in (OURS | PEERS).values()}
    assert files >= adapters | {"__init__.py", "__main__.py", "protocol.py"}


@pytest.mark.parametrize(
    ("adapter", "case"),
    [("ours", "springs:runge_kutta:damped"), ("mujoco_flex", "Euler:damped")],
)
def test_an_engine_steps_in_a_process_that_an_installed_wheel_starts(
    unpacked, adapter, case, tmp_path
):
    body = body_file(tmp_path, block((2, 2, 2), (0.02, 0.02, 0.02)))
    done = subprocess.run(
        [sys.executable, "-c", ONE_TURN, adapter, case, body],
        cwd=tmp_path,
        # Without the compiler: kernels at another place would all be compiled again.
        env=os.environ | {"PYTHONPATH": str(unpacked), "NUMBA_DISABLE_JIT": "1"},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    package, n_samples, moved = done.stdout.split()
    assert Path(package).is_relative_to(unpacked)
    assert int(n_samples) >= 3
    assert 0.0 < float(moved) < 0.01
