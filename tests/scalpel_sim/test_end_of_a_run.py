"""Whatever ends a run, what was done is in its folder, whole, and the first error is shown."""

import json
import os
import pty
import re
import shutil
import signal
import subprocess
import sys
import time

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.recording.recording import read_forces
from scalpel_sim.runs.file_names import RUN_FILES, STROKE
from tests.support.processes import PROGRAM, environment, start, wait_for_rows, wait_until_heard
from tests.support.run_files import names_in
from tests.support.small_disk import run_on_a_small_disk
from tests.support.whole_runs import broken_files

pytestmark = pytest.mark.end_to_end

LONG = ("--seconds", "1000")


def test_a_folder_in_which_a_run_goes_on_is_refused_to_another(tmp_path, capsys):
    program = start("run", "grid2", *LONG, "--out", str(tmp_path))
    wait_for_rows(program, tmp_path / "forces.csv")
    try:
        assert command_line(["run", "grid2", "--out", str(tmp_path)]) == 1
        assert re.search("another run is writing there.*--out", capsys.readouterr().err)
    finally:
        program.send_signal(signal.SIGINT)
        program.communicate(timeout=60)
    assert not broken_files(tmp_path)


def test_a_folder_whose_run_was_killed_takes_another_run_and_nothing_of_the_first_stays(tmp_path):
    program = start("run", "grid2", *LONG, "--out", str(tmp_path))
    wait_for_rows(program, tmp_path / "forces.csv")
    program.kill()
    program.communicate(timeout=60)
    (tmp_path / ".final.vtu.12.part").write_text("half of it")
    assert command_line(["run", "grid2", "--seconds", "0.02", "-q", "--out", str(tmp_path)]) == 0
    assert len(read_forces(tmp_path / "forces.csv")) == 20
    assert {path.name for path in tmp_path.iterdir()} - {".lock"} == set(RUN_FILES)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_while_the_program_is_loaded_is_said_in_one_line(number, tmp_path):
    program = start("run", "grid2", "--out", str(tmp_path / "run"))
    wait_until_heard(program)  # the packages are being loaded
    program.send_signal(number)
    _, err = program.communicate(timeout=60)
    assert program.returncode == 1
    assert err == f"error: interrupted by {number.name}\n"
    assert not (tmp_path / "run" / "initial.vtu").exists()


def test_a_signal_while_the_program_is_loaded_leaves_a_terminal_with_its_cursor():
    ours, theirs = pty.openpty()
    with os.fdopen(ours, "rb", buffering=0) as terminal:
        program = subprocess.Popen([*PROGRAM, "run"], stderr=theirs, env=environment())
        os.close(theirs)
        wait_until_heard(program)  # the packages are being loaded
        program.terminate()
        assert program.wait(timeout=60) == 1
        shown = b""
        while not shown.endswith(b"\n"):  # a terminal gives what it has
            shown += terminal.read(1000)
        assert shown.endswith(b"\x1b[?25herror: interrupted by SIGTERM\r\n")


def test_what_a_signal_interrupts_is_not_taken_down():
    """llvmlite frees twice what it is freeing just then."""
    code = """if True:
        import os, time
        from scalpel_sim.runs.stop_signals import SIGNALS, interrupt_on_signals, loading

        class Owner:
            def __del__(self):
                print("taken down", flush=True)

        def work():
            owner = Owner()
            os.kill(os.getpid(), SIGNALS[0])
            time.sleep(60.0)

        interrupt_on_signals()
        with loading():
            pass
        try:
            work()
        except KeyboardInterrupt as error:
            print(error, flush=True)
        os._exit(0)
    """
    out, err = start(program=(sys.executable, "-c", code)).communicate(timeout=60)
    assert out == "interrupted by SIGINT\n", err


def test_the_program_loads_no_library_of_windows_whose_process_a_signal_would_leave_alone(tmp_path):
    code = (
        "import atexit, sys; atexit.register(lambda: print('glfw' in sys.modules)); "
        "from scalpel_sim.__main__ import main; main()"
    )
    words = ("run", "grid2", "-q", "--seconds", "0.01", "--out", str(tmp_path / "run"))
    out, err = start(*words, program=(sys.executable, "-c", code)).communicate(timeout=120)
    assert out.splitlines()[-1] == "False", err


def test_ctrl_c_pressed_twice_in_a_moment_is_pressed_once(tmp_path):
    program = start("run", "grid2", *LONG, "--out", str(tmp_path))
    wait_for_rows(program, tmp_path / "forces.csv")
    for _ in range(3):
        program.send_signal(signal.SIGINT)
        time.sleep(0.1)
    _, err = program.communicate(timeout=60)
    assert program.returncode == 1
    assert "interrupted by SIGINT after" in err
    assert not broken_files(tmp_path)
    assert names_in(tmp_path) == sorted(RUN_FILES)


def test_a_signal_that_the_process_ignores_does_not_end_its_run(tmp_path):
    words = ["run", "grid2", "--seconds", "1.5", "-q", "--out", str(tmp_path)]
    program = start(*words, program=["nohup", shutil.which("python"), "-m", "scalpel_sim"])
    wait_for_rows(program, tmp_path / "forces.csv")
    program.send_signal(signal.SIGHUP)
    program.communicate(timeout=60)
    assert program.returncode == 0
    assert len(read_forces(tmp_path / "forces.csv")) == 1500


def test_a_signal_while_files_are_written_leaves_them_whole(tmp_path):
    program = start("run", "grid2", "--seconds", "0.1", "--out", str(tmp_path))
    while not (tmp_path / "final.vtu").exists():
        assert program.poll() is None, program.communicate()
        time.sleep(0.002)
    program.send_signal(signal.SIGTERM)
    _, err = program.communicate(timeout=60)
    assert program.returncode == 1
    assert "interrupted by SIGTERM when the run was complete" in err
    assert json.loads((tmp_path / "summary.json").read_text())["status"] == "complete"
    assert names_in(tmp_path) == sorted(RUN_FILES)
    assert not broken_files(tmp_path)


@pytest.mark.usefixtures("small_disks")
@pytest.mark.parametrize(
    ("megabytes", "message"),
    [(1, "initial.vtu|no room for"), (20, "no room for 2. MB"), (200, None)],
)
def test_a_disk_without_room_for_a_run_is_said_before_it_begins(megabytes, message, tmp_path):
    done = run_on_a_small_disk(
        "run", "slab", "--seconds", "0.02", "-q", megabytes=megabytes, copy_to=tmp_path
    )
    assert done.returncode == (0 if message is None else 1), done.stderr
    assert message is None or re.search(message, done.stderr)
    assert not broken_files(tmp_path)
    assert (tmp_path / "final.vtu").exists() == (message is None)


def test_what_a_hand_did_is_kept_when_the_disk_takes_it_later(tmp_path):
    # In a process of its own: the limit of the system is that of a whole process.
    code = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from scalpel_sim.output.plot_process import Plotter\n"
        "from scalpel_sim.runs.run_folder import Outputs\n"
        "from scalpel_sim.errors import RunError\n"
        "with Plotter() as plotter, Outputs(Path(sys.argv[1]), plotter) as outputs:\n"
        "    rows = [[float(i)] * 13 for i in range(100)]\n"
        "    columns = [f'a{i}' for i in range(13)]\n"
        "    outputs.write_driven('stroke.csv', columns, rows[:10])\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))\n"
        "    try:\n"
        "        outputs.write_driven('stroke.csv', columns, rows[10:])\n"
        "    except RunError as error:\n"
        "        print(error)\n"
        "    resource.setrlimit(resource.RLIMIT_FSIZE, (-1, resource.RLIM_INFINITY))\n"
        "    outputs.write_pending()\n"
    )
    command = [shutil.which("python"), "-c", code, str(tmp_path)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert re.search(f"{STROKE}: cannot be written", done.stdout), done.stderr
    rows = (tmp_path / STROKE).read_text().splitlines()[1:]
    assert [float(row.split(",")[0]) for row in rows] == list(range(100))
    assert os.stat(tmp_path / STROKE).st_size > 1000


def test_ctrl_c_ends_a_run_whose_tissue_elsewhere_does_not_answer(tmp_path):
    server = start("serve", "grid2", "--port", "0")
    try:
        address = re.search(r"127\.0\.0\.1:\d+", server.stdout.readline()).group()
        program = start("run", "--connect", address, *LONG, "--out", str(tmp_path))
        wait_for_rows(program, tmp_path / "forces.csv")
        server.send_signal(signal.SIGSTOP)
        time.sleep(0.5)
        program.send_signal(signal.SIGINT)
        _, err = program.communicate(timeout=30)
    finally:
        server.kill()
        server.communicate()
    assert program.returncode == 1
    assert re.search("interrupted by SIGINT.*does not answer; .*, but not final.vtu", err)
    assert {"summary.json", "forces.csv", "force.png", "replay.html"} <= set(names_in(tmp_path))
    assert not broken_files(tmp_path)
