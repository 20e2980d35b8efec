"""What `run --resume` and `--checkpoint` refuse, in one line that says what to do."""

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_WRONG_USE


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("slab --resume out/a", "omit the scene and --hand"),
        ("--resume out/a --hand device", "omit the scene and --hand"),
        ("--resume out/a --toughness 5", "--toughness is given with --resume"),
        ("--resume out/a --out out/b", "--out is given with --resume"),
        ("--resume out/a --set solver.threads=2", "--set is given with --resume"),
        ("--resume out/a --connect 127.0.0.1:1", "--connect is given with --resume"),
        ("--resume out/a", "there is no such folder"),
        ("slab --checkpoint -1", "--checkpoint is -1.0; it must be a time"),
        ("slab --checkpoint nan", "--checkpoint is nan; it must be a time"),
        ("--checkpoint 1 --connect 127.0.0.1:1", "--connect has it elsewhere; omit one of them"),
    ],
)
def test_options_that_make_no_sense_together_are_refused(
    words, message, capsys, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    assert command_line(["run", *words.split()]) == EXIT_WRONG_USE
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert message in line
    assert list(tmp_path.iterdir()) == []
