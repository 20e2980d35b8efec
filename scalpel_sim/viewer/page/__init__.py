"""The web pages of the live viewer and of the replay, built around meshcat's JavaScript viewer."""

import html
import importlib.util
from pathlib import Path
from string import Template

from scalpel_sim.errors import RunError

_HERE = Path(__file__).parent
"""Folder of the parts of the pages."""
_BUNDLE = Path("viewer", "dist", "main.min.js")
"""Path of the JavaScript bundle of meshcat's viewer inside the Python package meshcat."""
_OF_ALL_PAGES = (
    "field_colours.js",
    "scene_view.js",
    "controls.js",
    "looks.js",
    "picture.js",
)
"""Scripts that every page has first, in order."""
_REQUIREMENT = "meshcat>=0.3.2,<0.4"
"""Versions of meshcat that have the bundle there, as `pyproject.toml` requires them."""


def live_page(title: str, caption: str, token: str | None = None, *, is_led: bool = False) -> str:
    """Return a page that follows a run over a web socket.

    Args:
        title: Heading of the page.
        caption: Text below the heading.
        token: What the page shows the server so as to control the run; None: it controls nothing.
        is_led: Whether the page leads the blade, too.

    Raises:
        RunError: meshcat's viewer was not found.
    """
    if token is None:
        return _page(title, caption, ("live.js",))
    hand = ("hand_input.js", "gamepad.js", "hand.js") if is_led else ()
    parts = ("hand", "run") if is_led else ("run",)
    return _page(
        title,
        caption,
        ("run.js", *hand, "live.js"),
        controls="".join((_HERE / f"{part}.html").read_text("utf-8") for part in parts),
        data=f'<script>const TOKEN = "{token}";</script>',
        style="".join((_HERE / f"{part}.css").read_text("utf-8") for part in parts),
    )


def replay_page(title: str, caption: str, packets: str) -> str:
    """Return a page that plays a run and needs no network.

    Args:
        title: Heading of the page.
        caption: Text below the heading.
        packets: Script elements that hold the packets of the run.

    Raises:
        RunError: meshcat's viewer was not found.
    """
    controls = (_HERE / "player.html").read_text("utf-8")
    return _page(title, caption, ("replay.js",), controls, packets)


def _page(
    title: str,
    caption: str,
    scripts: tuple[str, ...],
    controls: str = "",
    data: str = "",
    style: str = "",
) -> str:
    """Return one self-contained HTML document.

    Args:
        title: Heading of the page.
        caption: Text below the heading.
        scripts: Files of its own scripts, in order.
        controls: Elements of its bar.
        data: Script elements that come before these.
        style: Rules beside those of all pages.
    """
    return Template((_HERE / "page.html").read_text("utf-8")).substitute(
        title=html.escape(title),
        caption=html.escape(caption),
        style=(_HERE / "page.css").read_text("utf-8") + style,
        controls=controls,
        meshcat=_meshcat_bundle().read_text("utf-8"),
        data=data,
        scripts="\n".join(
            (_HERE / script).read_text("utf-8") for script in (*_OF_ALL_PAGES, *scripts)
        ),
    )


def _meshcat_bundle() -> Path:
    """Return the path of meshcat's viewer without importing meshcat, which would import IPython.

    Raises:
        RunError: meshcat is not installed, or its viewer is not where it was in tested versions.
    """
    spec = importlib.util.find_spec("meshcat")
    folders = spec.submodule_search_locations if spec is not None else None
    if not folders:
        raise RunError(
            f"meshcat, whose viewer draws the page, is not installed: pip install '{_REQUIREMENT}'"
        )
    bundle = Path(folders[0]) / _BUNDLE
    if not bundle.is_file():
        raise RunError(
            f"meshcat's viewer, which draws the page, is not at {bundle}: pip install "
            f"'{_REQUIREMENT}'"
        )
    return bundle
