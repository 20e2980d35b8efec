import json

import pytest

from scalpel_sim.cli.app import command_line
from scalpel_sim.validate import scenes
from scalpel_sim.validate.findings import THEORY, Check, Findings, ValidationScene


def test_a_scene_is_run_and_reported(tmp_path, capsys):
    words = ["validate", "--only", "rate", "--quick", "--out", str(tmp_path / "new")]
    assert command_line(words) == 0
    out, err = capsys.readouterr()
    assert "3 of 3 checks are within their bounds" in " ".join(out.split())
    assert "1 of 1: Speed and bluntness of the edge" in err
    content = json.loads((tmp_path / "new" / "validation.json").read_text(encoding="utf-8"))
    assert content["passed"] and content["quick"]
    page = (tmp_path / "new" / "validation.md").read_text(encoding="utf-8")
    assert "(validation_rate.png)" in page
    assert (tmp_path / "new" / "validation_rate.png").read_bytes()[:4] == b"\x89PNG"


def test_a_check_that_fails_ends_with_exit_code_3(tmp_path, capsys, monkeypatch):
    failing = Check("it", 2.0, 0.0, 1.0, basis=THEORY)
    wrong = ValidationScene("wrong", "Wrong", "It is.", lambda quick: Findings([failing]))
    monkeypatch.setitem(scenes.VALIDATION_SCENES, "wrong", wrong)
    words = ["validate", "--only", "wrong", "--json", "-q", "--out", str(tmp_path)]
    assert command_line(words) == 3
    out, err = capsys.readouterr()
    content = json.loads(out)  # nothing else is on standard output
    assert content["counts"]["failed"] == 1 and content["passed"] is False
    assert "1 check is out of bounds" in err and "validation.md" in err


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["--only", "stedy"], "Did you mean 'steady'"),
        (["--out", "{file}"], "is a file"),
        (["--quik"], "--quick"),
    ],
)
def test_wrong_use_is_one_line_before_anything_is_run(words, expected, tmp_path, capsys):
    file = tmp_path / "file"
    file.write_text("")
    code = command_line(["validate", *(word.format(file=file) for word in words)])
    err = capsys.readouterr().err
    assert code == 2
    assert expected in err and err.startswith("error: ") and err.count("\n") == 1
