import json

import pytest

from scalpel_sim.datasets.card import LICENCE, Card
from scalpel_sim.datasets.dataset import write_dataset
from scalpel_sim.datasets.lerobot_writer import LeRobotWriter
from scalpel_sim.datasets.whole_folder import expect_new_folder
from scalpel_sim.errors import Interrupted, RunError, UsageError
from tests.scalpel_sim.datasets.drawn_demonstrations import LAYOUT, DrawnDemonstration

pytest.importorskip("pyarrow")

CARD = Card("Cuts", "LeRobot v3.0", LICENCE, "llvmpipe", LAYOUT)


def write(folder, episodes):
    return write_dataset(folder, episodes, lambda there: LeRobotWriter(there, LAYOUT), CARD)


def names_in(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_dataset_has_a_card_with_its_licence_and_where_it_comes_from(tmp_path):
    found = write(tmp_path / "cuts", [DrawnDemonstration(0, 3), DrawnDemonstration(1, 4)])
    assert (found.n_episodes, found.n_steps) == (2, 7)
    assert names_in(tmp_path) == ["cuts"]
    card = (tmp_path / "cuts" / "README.md").read_text()
    assert card.startswith("---\nlicense: cc-by-4.0\n")
    assert "| Control steps | 7, 50 a second, 0.1 s |" in card
    told = json.loads((tmp_path / "cuts" / "provenance.json").read_text())
    assert told["renderer"] == "llvmpipe"
    assert [each["steps"] for each in told["episodes"]] == [3, 4]


def test_an_interrupted_dataset_has_the_episodes_before_and_says_so(tmp_path):
    stopped = DrawnDemonstration(1, 4, Interrupted("interrupted by SIGINT"))
    with pytest.raises(Interrupted, match=r"SIGINT; .*cuts has the 1 of 3 demonstrations"):
        write(tmp_path / "cuts", [DrawnDemonstration(0, 3), stopped, DrawnDemonstration(2, 5)])
    info = json.loads((tmp_path / "cuts" / "meta" / "info.json").read_text())
    assert (info["total_episodes"], info["total_frames"]) == (1, 3)


@pytest.mark.parametrize("error", [Interrupted("stop"), KeyboardInterrupt(), OSError("full")])
def test_a_dataset_of_no_whole_episode_leaves_nothing(tmp_path, error):
    with pytest.raises((Interrupted, KeyboardInterrupt, RunError)):
        write(tmp_path / "cuts", [DrawnDemonstration(0, 3, error), DrawnDemonstration(1, 4)])
    assert names_in(tmp_path) == []


def test_a_folder_that_has_something_is_refused_and_stays(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(UsageError, match="is there already"):
        expect_new_folder(tmp_path)
    with pytest.raises(UsageError, match="there is no folder"):
        expect_new_folder(tmp_path / "no" / "such")
    assert names_in(tmp_path) == ["mine.txt"]
