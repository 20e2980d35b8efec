"""The picture of the README: one command makes it."""

import json

import matplotlib.image
import numpy as np

from scalpel_sim.cli.app import command_line
from scalpel_sim.figures import figures


def test_the_picture_of_the_readme_shows_the_organ_as_it_is_cut(monkeypatch, tmp_path, capsys):
    monkeypatch.setattr(figures, "_WIDTH", 240)
    monkeypatch.setattr(figures, "HEIGHT", 195)
    monkeypatch.chdir(tmp_path)
    assert command_line(["figure", "organ", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["file"] == "figureorgan.png"
    before, after = printed["n_tetrahedra"]
    assert 5136 < before < after
    image = matplotlib.image.imread(printed["file"])
    assert image.shape[:2] == (195, 2 * 240 + figures.GAP)
    # Faces of the cut are dark red; skin has 0.4 of its red in green, shadows have all of it.
    red = (image[:, :, 0] > 0.2) & (image[:, :, 1] < 0.25 * image[:, :, 0])
    halves = np.array_split(red, 2, axis=1)
    assert 0 < halves[0].sum() < halves[1].sum()  # the cut is visible, and grows
