"""Whether images can be drawn here."""

import functools

import pytest


@functools.cache
def lack_of_renderer() -> str:
    """Return why images cannot be drawn; "" where they can."""
    from scalpel_sim.camera.gl_context import RenderError, renderer_name

    try:
        renderer_name()
    except RenderError as error:
        return str(error)
    return ""


@pytest.fixture
def renderer() -> None:
    """Skip a test that draws, only where no OpenGL is there."""
    if lack_of_renderer():
        pytest.skip(lack_of_renderer())


needs_renderer = pytest.mark.usefixtures("renderer")
"""Marks tests that draw."""
