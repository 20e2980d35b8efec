"""Files of films: MP4 and WebM by the user's own ffmpeg, animated PNG, GIF and WebP by Pillow."""

import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import IO, Any, Protocol, Self, cast

import numpy as np
from PIL import Image

from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.errors import RunError, UsageError, writing
from scalpel_sim.output.export import check_file
from tissue.support import whole_file

_BY_FFMPEG: dict[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    ".mp4": (
        ("libx264", ("-crf", "18")),
        ("libopenh264", ("-b:v", "8M")),
        ("h264_videotoolbox", ("-b:v", "8M")),
        ("mpeg4", ("-q:v", "2")),
    ),
    ".webm": (
        ("libvpx-vp9", ("-crf", "24", "-b:v", "0")),
        ("libvpx", ("-crf", "8", "-b:v", "8M")),
        ("libaom-av1", ("-crf", "26", "-b:v", "0")),
    ),
}
"""Encoders of ffmpeg for each kind of file, the best first, with what they are told."""

_CODECS = {
    "libx264": "h264",
    "libopenh264": "h264",
    "h264_videotoolbox": "h264",
    "mpeg4": "mpeg4",
    "libvpx-vp9": "vp9",
    "libvpx": "vp8",
    "libaom-av1": "av1",
}
"""Name of the coding of each encoder."""

_BY_PILLOW = {".png": "PNG", ".apng": "PNG", ".gif": "GIF", ".webp": "WEBP"}

_GIF_COLOURS = 255

_MS_PER_S = 1e3


class FilmFile(Protocol):
    """A film that is being written. It is there once it was left without an error."""

    def __enter__(self) -> Self: ...

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None: ...

    def add(self, frame: np.ndarray) -> None:
        """Add a frame: bytes of red, green and blue, shape (height, width, 3)."""


def film_path(path: Path) -> tuple[Path, str]:
    """Return the file that a film is written to, and what to say of it; "" for nothing.

    Where ffmpeg is not on the PATH, an animated PNG takes the place of MP4 and WebM.

    Args:
        path: The file that was asked for.

    Raises:
        UsageError: no kind of film has its suffix, or its folder is not there.
        RunError: the system refuses, or ffmpeg has no encoder for such files.
    """
    suffix, told = path.suffix.lower(), ""
    if suffix not in (*_BY_FFMPEG, *_BY_PILLOW):
        kinds = ", ".join((*_BY_FFMPEG, *_BY_PILLOW))
        raise UsageError(f"--output is {path}; the name of a film must end in one of {kinds}")
    if suffix in _BY_FFMPEG:
        if shutil.which("ffmpeg") is None:
            path, suffix = path.with_suffix(".png"), ".png"
            told = f"ffmpeg is not on the PATH: {path} is an animated PNG, which browsers play"
        else:
            _encoder(suffix)
    check_file(path, suffix, "--output")
    return path, told


def open_film(
    path: Path, size: PixelSize, fps: float, *, keyframe_every: int | None = None
) -> FilmFile:
    """Return a film that is yet to be entered.

    Args:
        path: What `film_path` returned.
        size: Size of its frames [pixels].
        fps: Frames in a second.
        keyframe_every: Number of frames from one that ffmpeg encodes by itself to the next; None:
            as it likes.
    """
    if path.suffix.lower() in _BY_FFMPEG:
        return _FilmByFfmpeg(path, size, fps, keyframe_every)
    return _FilmByPillow(path, fps)


def codec_of(suffix: str) -> str:
    """Return the name of the coding of films of a suffix, which ffmpeg writes.

    Raises:
        RunError: there is no ffmpeg, or it has no encoder for such files.
    """
    return _CODECS[_encoder(suffix)[1]]


def _encoder(suffix: str) -> Sequence[str]:
    """Return what tells ffmpeg how to encode files of a suffix.

    Raises:
        RunError: it has no such encoder.
    """
    command = ["ffmpeg", "-hide_banner", "-loglevel", "error", "-encoders"]
    try:
        listed = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    except (OSError, subprocess.CalledProcessError) as error:
        raise RunError(f"ffmpeg does not list its encoders: {error}") from error
    known = {words[1] for line in listed.splitlines() if len(words := line.split()) > 1}
    for name, told in _BY_FFMPEG[suffix]:
        if name in known:
            return ("-c:v", name, *told)
    wanted = ", ".join(name for name, _ in _BY_FFMPEG[suffix])
    raise RunError(
        f"this ffmpeg has no encoder for {suffix} ({wanted}); choose another suffix, as .gif"
    )


class _FilmByFfmpeg:
    """A film that ffmpeg encodes while it is made."""

    def __init__(self, path: Path, size: PixelSize, fps: float, keyframe_every: int | None) -> None:
        self._path, self._size, self._fps = path, size, fps
        self._told = () if keyframe_every is None else ("-g", str(keyframe_every))

    def __enter__(self) -> Self:
        suffix = self._path.suffix.lower()
        self._whole = whole_file(self._path)
        unfinished = self._whole.__enter__()
        # Its colours are at half the resolution, of which there must be whole pixels.
        even = "pad=ceil(iw/2)*2:ceil(ih/2)*2,format=yuv420p"
        size = f"{self._size.width}x{self._size.height}"
        given = ("-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{self._fps:g}")
        command = ["ffmpeg", "-hide_banner", "-loglevel", "error", "-y", *given, "-i", "-"]
        command += ["-an", "-vf", even, *_encoder(suffix), *self._told]
        command += ["-movflags", "+faststart"] if suffix == ".mp4" else []
        self._said = tempfile.TemporaryFile()
        # Ctrl-C is for the program, which then ends it.
        self._process = subprocess.Popen(
            [*command, "-f", suffix[1:], str(unfinished)],
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._said,
            start_new_session=True,
        )
        return self

    def add(self, frame: np.ndarray) -> None:
        """Add a frame."""
        try:
            cast(IO[bytes], self._process.stdin).write(np.ascontiguousarray(frame).data)
        except OSError as error:
            raise RunError(f"{self._path}: {self._reason()}") from error

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        failed: BaseException | None = error
        try:
            if error is not None:
                self._process.kill()
            cast(IO[bytes], self._process.stdin).close()
        except OSError:  # it has ended
            pass
        if self._process.wait() != 0 and failed is None:
            failed = RunError(f"{self._path}: {self._reason()}")
        self._said.close()
        if failed is None:
            self._whole.__exit__(None, None, None)
            return
        self._whole.__exit__(type(failed), failed, trace)
        if error is None:
            raise failed

    def _reason(self) -> str:
        """Return what ffmpeg said last."""
        self._process.wait()
        self._said.seek(0)
        lines = self._said.read().decode("utf-8", "replace").strip().splitlines()
        return f"ffmpeg failed: {lines[-1] if lines else self._process.returncode}"


class _FilmByPillow:
    """A film that is written when all its frames are there."""

    def __init__(self, path: Path, fps: float) -> None:
        self._path, self._fps = path, fps
        self._frames: list[Image.Image] = []

    def __enter__(self) -> Self:
        return self

    def add(self, frame: np.ndarray) -> None:
        """Add a frame."""
        image = Image.fromarray(frame)
        if self._path.suffix.lower() == ".gif":
            image = image.quantize(_GIF_COLOURS)
        self._frames.append(image)

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        if error is not None or not self._frames:
            return
        first, *others = self._frames
        options: dict[str, Any] = {"save_all": True, "append_images": others, "loop": 0}
        options["duration"] = _MS_PER_S / self._fps
        kind_of_file = _BY_PILLOW[self._path.suffix.lower()]
        if kind_of_file != "PNG":
            options["duration"] = round(options["duration"])
        with writing(self._path, "another --output"), whole_file(self._path) as unfinished:
            first.save(unfinished, kind_of_file, **options)
