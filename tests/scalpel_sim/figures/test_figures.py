"""The figures: real cuts, drawn small."""

import json

import matplotlib.image
import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.cli.app import command_line
from scalpel_sim.figures import figures
from scalpel_sim.figures.cuts import FIGURE_10, FIGURE_10_MOMENTS, moments
from scalpel_sim.figures.mesh_drawing import cell_edges
from tests.scalpel_sim.coarse_lobe import with_coarse_lobe


@pytest.fixture
def small(monkeypatch, tmp_path):
    """Draw small panels, in a folder of its own."""
    draw_at(150, 120, monkeypatch, tmp_path)


@pytest.fixture
def wider(monkeypatch, tmp_path):
    """Draw panels in which instruments can be seen, in a folder of its own."""
    draw_at(240, 195, monkeypatch, tmp_path)


def draw_at(width, height, monkeypatch, folder):
    monkeypatch.setattr(figures, "PANEL_SIZE", PixelSize(width, height))
    monkeypatch.chdir(folder)


def red(image: np.ndarray) -> float:
    """Return the share of pixels that are clearly red."""
    return float(((image[:, :, 0] > 0.35) & (image[:, :, 1] < 0.5 * image[:, :, 0])).mean())


@pytest.mark.parametrize(("number", "n_panels"), [(10, 4), (11, 2), (12, 2)])
def test_each_figure_is_one_command(number, n_panels, small, capsys):
    assert command_line(["figure", str(number), "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["file"] == f"figure{number}.png"
    assert len(printed["labels"]) == len(printed["n_tetrahedra"]) == n_panels
    image = matplotlib.image.imread(printed["file"])
    assert image.shape[0] > 120 and image.shape[1] > 300
    assert 0.002 < red(image) < 0.5  # lines are thin
    assert (image[:, :, :3].min(axis=2) > 0.9).mean() > 0.3  # on white


def test_a_figure_can_be_cut_by_the_papers_own_scheme(small, capsys):
    """It divides a tetrahedron in up to 17; ours leaves less than half as many."""
    assert command_line(["figure", "11", "--json", "--scheme", "paper"]) == 0
    before, after = json.loads(capsys.readouterr().out)["n_tetrahedra"]
    assert before == 576 and after > 2000


def test_figure_10_grows_from_576_tetrahedra_as_the_blade_advances_and_its_cut_opens():
    seen = moments(FIGURE_10, FIGURE_10_MOMENTS)
    counts = [len(moment.snapshot.tetrahedra) for moment in seen]
    assert counts[0] == 576 and counts == sorted(counts) and counts[3] > counts[1] > 576
    areas = [moment.surface.is_cut.sum() for moment in seen]
    assert areas[0] == 0 and areas[1] < areas[2] <= areas[3]
    last = seen[-1].surface
    middle = last.positions[np.unique(last.triangles[last.is_cut])]
    upper = middle[middle[:, 2] > 0.9 * middle[:, 2].max()]
    assert np.ptp(upper[:, 0]) > 5e-3  # metres between the lips


def test_a_tetrahedron_has_six_edges_and_two_that_share_a_face_have_nine():
    assert len(cell_edges(np.array([[0, 1, 2, 3]]))) == 6
    assert len(cell_edges(np.array([[0, 1, 2, 3], [1, 2, 3, 4]]))) == 9


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["9"], "10, 11, 12"),
        (["10", "--output", "picture.jpg"], "must end in .png"),
        (["10", "--output", "nowhere/picture.png"], "no folder nowhere"),
    ],
)
def test_an_unknown_figure_or_an_invalid_output_is_refused(words, expected, small, capsys):
    assert command_line(["figure", *words]) == 2
    assert expected in capsys.readouterr().err


def test_the_picture_of_the_readme_shows_the_organ_as_it_is_cut(wider, capsys):
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


def test_the_picture_shows_what_the_left_hand_lifts_before_and_after_it_is_cut_off(
    wider, tmp_path, monkeypatch, capsys
):
    fast = with_coarse_lobe("retract", tmp_path, 'solver.relaxation="verlet"')
    monkeypatch.setitem(SCENES, "retract", fast)
    assert command_line(["figure", "retract", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["file"] == "figureretract.png"
    before, after = printed["n_tetrahedra"]
    assert before < after
    image = matplotlib.image.imread(printed["file"])
    assert image.shape[:2] == (195, 2 * 240 + figures.GAP)
    # Both instruments are of grey steel, and the handle of the scalpel is blue.
    for half in np.array_split(image[:, :, :3], 2, axis=1):
        red, green, blue = np.moveaxis(half, 2, 0)
        grey = (np.abs(red - blue) < 0.08) & (np.abs(red - green) < 0.08) & (red < 0.9)
        assert grey.sum() > 100 and (blue > 1.5 * red).sum() > 20


def test_the_picture_of_layers_shows_each_in_its_colour(small, monkeypatch, capsys):
    monkeypatch.setitem(figures.MOMENTS, "layers", (0.01, 0.02))
    assert command_line(["figure", "layers", "--json"]) == 0
    printed = json.loads(capsys.readouterr().out)
    red, green, blue = np.moveaxis(matplotlib.image.imread(printed["file"])[:, :, :3], 2, 0)
    fat = (red > 0.5) & (green > 0.7 * red) & (blue < 0.6 * red)
    muscle = (red > 0.3) & (green < 0.5 * red) & (blue < 0.5 * red)
    skin = (red > 0.5) & (green < 0.85 * red) & (green > 0.6 * red) & (blue > 0.6 * green)
    assert min(part.sum() for part in (fat, muscle, skin)) > 300
