"""OpenGL without a screen.

`mujoco.GLContext` is chosen by `MUJOCO_GL` where MuJoCo is imported, which the command line does
with `disable`, as it opens no window. So contexts are opened here, by the modules that MuJoCo has.
"""

import importlib
import os
import platform
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from scalpel_sim.errors import RunError

RENDERER_PACKAGES = "libegl1 libgl1-mesa-dri libopengl0"
"""Packages of Debian and Ubuntu that draw without a screen and without a graphics card."""

_BACKEND = "MUJOCO_GL"
_BACKENDS = ("egl", "osmesa", "glfw", "cgl")
_NO_CHOICE = (
    *("", "0", "1", "on", "off", "true", "false", "enable", "enabled", "disable", "disabled"),
    *("glx", "wgl"),
)
"""Other values that MuJoCo takes. They leave the choice to the system, as windows are not meant."""

_THREADS = "LP_NUM_THREADS"

_NO_THREADS = "0"
"""Threads of Mesa's renderer for processors besides the one that draws, where nobody asked for
others. An image is small: to pass it to a thread and back takes a tenth of its time, and what runs
beside it has a use for the other cores."""


_opened_in: set[int] = set()
"""Processes that have opened OpenGL: this one, or one that it was forked from."""

_set_aside: list[str] = []
"""Value of `MUJOCO_GL` before `set_backend_aside`; none before that was called."""


class RenderError(RunError):
    """There is no OpenGL that could draw.

    Args:
        what: What is wrong.
        remedy: What to do.
    """

    def __init__(self, what: str, remedy: str) -> None:
        super().__init__(f"images cannot be drawn: {what}. {remedy}")
        self.what, self.remedy = what, remedy

    def __reduce__(self) -> tuple[type["RenderError"], tuple[str, str]]:
        """Return how it is made again in the process that waits for images."""
        return RenderError, (self.what, self.remedy)


def set_backend_aside() -> None:
    """Keep MuJoCo from loading OpenGL, whatever `MUJOCO_GL` is; cameras still obey what it was.

    For the command line, before MuJoCo is loaded, and for the processes that it starts: none opens
    a window, and all that draws nothing works where no OpenGL does. To have a window MuJoCo loads
    glfw, which starts a process that looks for its library, and that writes a traceback where a
    signal ends the program meanwhile.
    """
    _set_aside[:] = [os.environ.get(_BACKEND, "")]
    os.environ[_BACKEND] = "disable"


def open_context() -> Any:
    """Return a new context of OpenGL, which is current in this thread.

    On Linux it is EGL's, which needs no screen, unless `MUJOCO_GL` says otherwise.

    Raises:
        RenderError: there is none, or `MUJOCO_GL` names none; the message says what to do.
    """
    expect_own_process()
    backend = _backend()
    os.environ.setdefault(_THREADS, _NO_THREADS)
    try:
        context = importlib.import_module(f"mujoco.{backend}").GLContext(1, 1)
        context.make_current()
        if backend == "glfw" and not _names():  # it warns where it finds no screen, and goes on
            raise RuntimeError("it needs a screen")
    # The libraries that are missing show as any of these.
    except (ImportError, AttributeError, RuntimeError, OSError) as error:
        unset = "" if backend == "egl" else f", and unset {_BACKEND}"
        raise RenderError(
            f"there is no OpenGL by {backend.upper()} ({_reason(error)})",
            f"On Debian and Ubuntu: apt-get install {RENDERER_PACKAGES}{unset}",
        ) from error
    _opened_in.add(os.getpid())
    return context


def _backend() -> str:
    """Return what opens OpenGL: what `MUJOCO_GL` names, or that of the system.

    Raises:
        RenderError: it names nothing that there is.
    """
    asked = _set_aside[0] if _set_aside else os.environ.get(_BACKEND, "")
    chosen = asked.lower().strip()
    if chosen in _BACKENDS:
        return chosen
    if chosen not in _NO_CHOICE:
        raise RenderError(
            f"the environment variable {_BACKEND} is {asked!r}",
            f"Unset it, or set it to {', '.join(_BACKENDS[:-1])} or {_BACKENDS[-1]}",
        )
    return {"Linux": "egl", "Darwin": "cgl"}.get(platform.system(), "glfw")


def expect_own_process() -> None:
    """Refuse to draw in a fork of a process that has drawn: Mesa's threads are not in it.

    Raises:
        RenderError: this is one; the message says what to do.
    """
    if _opened_in and os.getpid() not in _opened_in:
        raise RenderError(
            "this process was forked from one that has drawn images, which OpenGL does not survive",
            "Start it by `spawn` (multiprocessing.get_context), or fork before the first image",
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
