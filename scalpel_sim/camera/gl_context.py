"""OpenGL without a screen.

`mujoco.GLContext` is chosen by `MUJOCO_GL` where MuJoCo is imported, which the program does with
`disable`, as it opens no window. So contexts are opened here, by the modules that MuJoCo has.
"""

import importlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from scalpel_sim.errors import RunError

RENDERER_PACKAGES = "libegl1 libegl-mesa0 libgl1-mesa-dri libgl1"
"""Packages of Debian and Ubuntu that draw without a screen and without a graphics card."""

_BACKEND = "MUJOCO_GL"
_BACKENDS = ("egl", "osmesa", "glfw", "cgl")
_THREADS = "LP_NUM_THREADS"

_ONE_THREAD = "1"
"""Threads of Mesa's renderer for processors, where nobody asked for others: an image is small, and
what runs beside it has a use for the other cores."""


_opened_in: set[int] = set()
"""Processes that have opened OpenGL: this one, or one that it was forked from."""


class RenderError(RunError):
    """There is no OpenGL that could draw."""


def open_context() -> Any:
    """Return a new context of OpenGL, which is current in this thread.

    On Linux it is EGL's, which needs no screen, unless `MUJOCO_GL` says otherwise.

    Raises:
        RenderError: there is none; the message says what to install.
    """
    expect_own_process()
    backend = _backend()
    os.environ.setdefault(_THREADS, _ONE_THREAD)
    try:
        context = importlib.import_module(f"mujoco.{backend}").GLContext(1, 1)
        context.make_current()
        if backend == "glfw" and not _names():  # it warns where it finds no screen, and goes on
            raise RuntimeError("it needs a screen")
    # The libraries that are missing show as any of these.
    except (ImportError, AttributeError, RuntimeError, OSError) as error:
        otherwise = "" if backend == "egl" else f", and unset {_BACKEND}"
        raise RenderError(
            f"images cannot be drawn: there is no OpenGL by {backend.upper()} ({_reason(error)}). "
            f"On Debian and Ubuntu: apt-get install {RENDERER_PACKAGES}{otherwise}"
        ) from error
    _opened_in.add(os.getpid())
    return context


def _backend() -> str:
    """Return what opens OpenGL: what `MUJOCO_GL` names, or that of the system."""
    chosen = os.environ.get(_BACKEND, "").lower().strip()
    if chosen in _BACKENDS:
        return chosen
    return {"Linux": "egl", "Darwin": "cgl"}.get(platform.system(), "glfw")


def expect_own_process() -> None:
    """Refuse to draw in a fork of a process that has drawn: Mesa's threads are not in it.

    Raises:
        RenderError: this is one; the message says what to do.
    """
    if _opened_in and os.getpid() not in _opened_in:
        raise RenderError(
            "this process was forked from one that has drawn images, and OpenGL does not survive "
            "that. Start it by `spawn` (multiprocessing.get_context), or fork before the first "
            "image"
        )


@contextmanager
def chosen_backend() -> Iterator[None]:
    """Make MuJoCo load the functions of the context that `open_context` made."""
    before = os.environ.get(_BACKEND)
    os.environ[_BACKEND] = _backend()
    try:
        yield
    finally:
        if before is None:
            os.environ.pop(_BACKEND, None)
        else:
            os.environ[_BACKEND] = before


def renderer_name() -> str:
    """Return what draws: the names of renderer and version that OpenGL gives.

    Images of two renderers differ in a few bits: it belongs into a dataset.

    Raises:
        RenderError: there is none; the message says what to install.
    """
    context = open_context()
    try:
        return current_renderer()
    finally:
        context.free()


def current_renderer() -> str:
    """Return the names of renderer and version of the context that is current."""
    return ", OpenGL ".join(_names())


def _names() -> list[str]:
    """Return the names of renderer and version; none where no context is current."""
    gl = importlib.import_module("OpenGL.GL")
    names = (gl.glGetString(each) for each in (gl.GL_RENDERER, gl.GL_VERSION))
    return [name.decode("ascii", "replace") for name in names if name is not None]


def _reason(error: Exception) -> str:
    """Return the first line of an error."""
    lines = str(error).strip().splitlines()
    return lines[0] if lines else type(error).__name__
