"""Films: the same pictures each time, and files that play."""

import hashlib
import shutil
import subprocess

import numpy as np
import pytest
from PIL import Image, ImageSequence

from scalpel_sim import SCENES, Camera, prepare
from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.camera.film import film_frames
from scalpel_sim.camera.film_files import film_path, open_film
from scalpel_sim.camera.force_panel import ForcePanel
from scalpel_sim.cli.app import command_line
from scalpel_sim.errors import EXIT_OK, EXIT_WRONG_USE, RunError
from tests.support.egl import needs_renderer

needs_ffmpeg = pytest.mark.skipif(shutil.which("ffmpeg") is None, reason="no ffmpeg is there")

SMALL = ["--width", "64", "--height", "48", "--samples", "0", "--fps", "20"]


def pictures_of_slab(*, with_plot: bool = False) -> list[np.ndarray]:
    """Return the pictures of 0.2 s of the slab at 20 in a second."""
    simulation = prepare(SCENES["slab"], records=False)
    camera = Camera(simulation, width=64, height=48)
    panel = ForcePanel([], 0.2, PixelSize(64, 48)) if with_plot else None
    return list(film_frames(simulation, camera, lambda now: 0.2, interval=0.05, panel=panel))


@needs_renderer
def test_the_pictures_of_a_film_are_the_same_each_time():
    hashes = [
        [hashlib.sha256(picture.tobytes()).hexdigest() for picture in pictures_of_slab()]
        for _ in range(2)
    ]
    assert hashes[0] == hashes[1]
    assert len(hashes[0]) == 5 == len(set(hashes[0]))


@needs_renderer
def test_beside_the_pictures_the_plot_grows():
    plain, plotted = pictures_of_slab(), pictures_of_slab(with_plot=True)
    assert all(two.shape == (48, 128, 3) for two in plotted)
    assert all((one == two[:, :64]).all() for one, two in zip(plain, plotted, strict=True))
    plots = [two[:, 64:].tobytes() for two in plotted]
    assert len(set(plots)) == len(plots)


@needs_renderer
@pytest.mark.parametrize("suffix", [".png", ".gif", ".webp"])
def test_a_film_by_pillow_has_its_pictures_and_its_pace(suffix, tmp_path, capsys):
    path = tmp_path / f"slab{suffix}"
    asked = ["film", "slab", "--seconds", "0.2", *SMALL, "-o", str(path)]
    assert command_line(asked) == EXIT_OK
    assert capsys.readouterr().out.startswith(f"{path}: 5 pictures, 0.2 s of film, of slab, 0.20 s")
    with Image.open(path) as film:
        assert film.size == (64, 48) and film.n_frames == 5
        durations = []
        for frame in ImageSequence.Iterator(film):
            frame.load()
            durations.append(frame.info["duration"])
        film.seek(4)
        last = np.asarray(film.convert("RGB")).astype(int)
    assert all(duration == 50 for duration in durations[1:])
    assert (
        np.abs(last - pictures_of_slab()[-1]).mean() < {".png": 1e-9, ".gif": 6, ".webp": 6}[suffix]
    )


@needs_renderer
def test_a_film_of_a_run_is_that_of_its_scene_and_slow_motion_has_more_pictures(tmp_path, capsys):
    out, film, slow = (tmp_path / name for name in ("out", "film.png", "slow.png"))
    assert (
        command_line(["run", "slab", "--seconds", "0.2", "--quiet", "--out", str(out)]) == EXIT_OK
    )
    assert command_line(["film", str(out), *SMALL, "-o", str(film)]) == EXIT_OK
    assert command_line(["film", str(out), *SMALL, "--slow", "2", "-o", str(slow)]) == EXIT_OK
    with Image.open(film) as picture, Image.open(slow) as slower:
        assert (picture.n_frames, slower.n_frames) == (5, 9)
        for i, own in enumerate(pictures_of_slab()):
            picture.seek(i)
            slower.seek(2 * i)
            assert (np.asarray(picture.convert("RGB")) == own).all()
            assert (np.asarray(slower.convert("RGB")) == own).all()


@needs_renderer
def test_a_recorded_run_is_played_without_simulating(tmp_path, monkeypatch, capsys):
    out = tmp_path / "out"
    recording, played, simulated = (tmp_path / name for name in ("a.vtkhdf", "a.png", "b.png"))
    asked = ["run", "slab", "--seconds", "0.2", "--quiet", "--out", str(out)]
    assert command_line([*asked, "--record", str(recording)]) == EXIT_OK
    assert (
        command_line(["film", "slab", "--seconds", "0.2", *SMALL, "-o", str(simulated)]) == EXIT_OK
    )
    monkeypatch.setattr("scalpel_sim.cli.camera_run.prepare", None)
    assert command_line(["film", str(recording), *SMALL, "--plot", "-o", str(played)]) == EXIT_OK
    with Image.open(played) as one, Image.open(simulated) as other:
        assert one.n_frames == other.n_frames == 5 and one.size == (128, 48)
        for i in (0, 4):
            one.seek(i)
            other.seek(i)
            pictures = [
                np.asarray(film.convert("RGB"))[:, :64].astype(int) for film in (one, other)
            ]
            # Round shapes of the arm have other facets, and a floor has an end.
            assert np.median(np.abs(pictures[0][:, :64] - pictures[1])) <= 2


@needs_renderer
def test_in_slow_motion_a_folder_is_simulated_and_a_recording_repeats_its_steps(tmp_path, capsys):
    out = tmp_path / "out"
    recording = out / "run.vtkhdf"
    out.mkdir()
    asked = ["run", "slab", "--seconds", "0.08", "--quiet", "--out", str(out)]
    assert command_line([*asked, "--record", str(recording)]) == EXIT_OK
    n_seen = []
    for of, film in ((out, tmp_path / "a.png"), (recording, tmp_path / "b.png")):
        assert command_line(["film", str(of), *SMALL, "--slow", "5", "-o", str(film)]) == EXIT_OK
        assert ("several of them are the same" in capsys.readouterr().err) == (of == recording)
        with Image.open(film) as picture:
            frames = [frame.convert("RGB").tobytes() for frame in ImageSequence.Iterator(picture)]
        n_seen.append(len(set(frames)))
    assert n_seen[1] == 3 < n_seen[0]


def gradients() -> list[np.ndarray]:
    """Return pictures of an odd size whose colours go by."""
    y, x = np.mgrid[0:49, 0:65]
    return [np.stack([3 * x, 4 * y, 0 * x + 20 * i], axis=2).astype(np.uint8) for i in range(8)]


@needs_ffmpeg
@pytest.mark.parametrize("suffix", [".mp4", ".webm"])
def test_a_film_by_ffmpeg_plays_what_was_put_in(suffix, tmp_path):
    path, _ = film_path(tmp_path / f"a{suffix}")
    with open_film(path, PixelSize(65, 49), 20.0) as film:
        for picture in gradients():
            film.add(picture)
    command = ["ffmpeg", "-v", "error", "-i", str(path), "-f", "rawvideo", "-pix_fmt", "rgb24", "-"]
    played = subprocess.run(command, capture_output=True, check=True).stdout
    pictures = np.frombuffer(played, np.uint8).reshape(8, 50, 66, 3).astype(int)
    for one, other in zip(pictures, gradients(), strict=True):
        assert np.abs(one[:49, :65] - other).mean() < 8
    assert [each.name for each in tmp_path.iterdir()] == [path.name]


@needs_ffmpeg
def test_a_film_that_is_broken_off_leaves_no_file(tmp_path):
    path, _ = film_path(tmp_path / "a.mp4")
    with pytest.raises(KeyError), open_film(path, PixelSize(64, 48), 20.0) as film:
        film.add(np.zeros((48, 64, 3), np.uint8))
        raise KeyError
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_an_animated_png_takes_its_place(tmp_path, monkeypatch):
    monkeypatch.setenv("PATH", str(tmp_path))
    path, told = film_path(tmp_path / "cut.mp4")
    assert path == tmp_path / "cut.png"
    assert "ffmpeg is not on the PATH" in told and "cut.png is an animated PNG" in told


FAILING = """#!/bin/sh
case "$*" in
*-encoders*) echo " V..... libx264 H.264" ;;
*) echo "no space left" >&2; exit 1 ;;
esac
"""


def test_an_ffmpeg_that_fails_is_quoted(tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text(FAILING)
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    path, _ = film_path(tmp_path / "a.mp4")
    with pytest.raises(RunError, match="ffmpeg failed: no space left"):  # noqa: SIM117
        with open_film(path, PixelSize(640, 480), 20.0) as film:
            for _ in range(50):
                film.add(np.zeros((480, 640, 3), np.uint8))
    assert not path.exists()


def test_an_ffmpeg_without_an_encoder_is_refused(tmp_path, monkeypatch):
    program = tmp_path / "ffmpeg"
    program.write_text(FAILING.replace("libx264", "flv"))
    program.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    with pytest.raises(RunError, match=r"has no encoder for \.mp4"):
        film_path(tmp_path / "a.mp4")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["slab", "-o", "a.avi"], "the name of a film must end in one of"),
        (["slab", "-o", "a.gif", "--fps", "0"], "--fps is 0; it must be from 1 to 120"),
        (["slab", "-o", "a.gif", "--slow", "0"], "--slow is 0"),
        (["there", "-o", "a.gif"], "there has no scene.toml"),
        (["there.vtkhdf", "-o", "a.gif", "--toughness", "3"], "toughness"),
        (["there.vtkhdf", "-o", "a.gif"], "there.vtkhdf: there is no such file"),
    ],
)
def test_what_cannot_be_filmed_is_refused(options, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    assert command_line(["film", *options]) == EXIT_WRONG_USE
    assert message in capsys.readouterr().err
