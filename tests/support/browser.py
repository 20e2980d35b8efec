"""A headless Chromium for tests of web pages."""

import io
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")

DETERMINISTIC = (
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
)
"""Draw in software, the same on every machine, and open no network connection."""

WINDOW = {"width": 480, "height": 360}

UNTIL_DRAWN = """async () => {
    const picture = () => new Promise(requestAnimationFrame);
    const isCoarse = () => document.body.classList.contains("coarse");
    const end = performance.now() + 3000;
    while (isCoarse() && performance.now() < end) await picture();
    await picture();
    await picture();
}"""
"""Resolves when all changes made so far are on the screen, as a page draws what rests."""

TIMEOUT = 180_000
"""How long a page may take [ms]: drawing in software on a busy machine is slow. With nine busy
processes to a core it took more than 60 s."""


def first_installed(names: tuple[str, ...]) -> str | None:
    """Return the path of the first of these programs that is installed."""
    return next(filter(None, map(shutil.which, names)), None)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """Start Chromium without a window; skip the test if it is not installed."""
    executable = first_installed(NAMES)
    if executable is None:
        pytest.skip("no Chromium on this machine: apt-get install chromium")
    playwright = pytest.importorskip("playwright.sync_api", reason="pip install playwright")
    with playwright.sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=executable, args=list(DETERMINISTIC), timeout=TIMEOUT
        )
        yield chromium
        chromium.close()


@pytest.fixture
def tab(browser: Any) -> Iterator[Any]:
    """Open an empty tab; the test fails if a script in it fails."""
    page = new_tab(browser)
    yield page
    page.close()
    assert page.failures == []


def new_tab(browser: Any) -> Any:
    """Open a tab that collects, as `failures`, the errors of its scripts."""
    # Tests wait for texts of functions, which the policy of our pages lets nobody evaluate.
    page = browser.new_page(viewport=WINDOW, bypass_csp=True)
    page.set_default_timeout(TIMEOUT)
    page.failures = []
    page.on("pageerror", lambda error: page.failures.append(str(error)))
    return page


def pixels(tab: Any) -> np.ndarray:
    """Return what a tab shows: red, green and blue from 0 to 255, shape (height, width, 3)."""
    from PIL import Image

    tab.evaluate(UNTIL_DRAWN)
    return np.asarray(Image.open(io.BytesIO(tab.screenshot())).convert("RGB"), dtype=int)


def pixels_of(tab: Any, path: str) -> np.ndarray:
    """Return the pixels that change when an object of the scene is hidden, shape (n, 3)."""
    with_it = pixels(tab)
    set_visible(tab, path, False)
    without_it = pixels(tab)
    set_visible(tab, path, True)
    return with_it[np.abs(with_it - without_it).max(axis=2) > 12]


def set_visible(tab: Any, path: str, is_visible: bool) -> None:
    """Show or hide an object of meshcat's scene tree."""
    tab.evaluate(
        """([path, visible]) => {
            viewer.set_property(path.split("/"), "visible", visible);
            viewer.set_dirty();
        }""",
        [path, is_visible],
    )


def local_file(path: Path) -> str:
    """Return the URL of a file on this machine."""
    return path.resolve().as_uri()
