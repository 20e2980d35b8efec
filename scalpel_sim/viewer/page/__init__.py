"""The web pages of the live viewer and of the replay, built around meshcat's JavaScript viewer."""

import base64
import hashlib
import html
import importlib.util
import re
from collections.abc import Sequence
from pathlib import Path
from string import Template

import msgspec

from scalpel_sim.errors import RunError
from scalpel_sim.viewer.messages import Choices

_HERE = Path(__file__).parent
"""Folder of the parts of the pages."""
_BUNDLE = Path("viewer", "dist", "main.min.js")
"""Path of the JavaScript bundle of meshcat's viewer inside the Python package meshcat."""
_OF_ALL_PAGES = (
    "renderer.js",
    "lights.js",
    "materials.js",
    "force_marks.js",
    "field_colours.js",
    "smooth.js",
    "see_through.js",
    "ribbons.js",
    "plan.js",
    "scene_view.js",
    "coarseness.js",
    "controls.js",
    "looks.js",
    "picture.js",
)
"""Scripts that every page has first, in order."""
_CHARSET = '<meta charset="utf-8">'
_POLICY = '<meta http-equiv="Content-Security-Policy" content="{}">'
_REQUIREMENT = "meshcat>=0.3.2,<0.4"
"""Versions of meshcat that have the bundle there, as `pyproject.toml` requires them."""


PAGE_HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""Headers of every answer: the page is for nobody but who requested it."""

_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


def live_page(
    title: str,
    caption: str,
    token: str | None = None,
    *,
    is_led: bool = False,
    choices: Choices | None = None,
) -> str:
    """Return a page that follows a run over a web socket.

    Args:
        title: Heading of the page.
        caption: Text below the heading.
        token: What the page shows the server so as to control the run; None: it controls nothing.
        is_led: Whether the page leads the blade, too.
        choices: What the page may request in the next run.

    Raises:
        RunError: meshcat's viewer was not found.
    """
    scripts = list(_OF_ALL_PAGES)
    if token is None:
        return _page(title, caption, [*scripts, "force_plot.js", "live.js"])
    bars, panels = ["run"], []
    scripts += ["results.js", "run.js", "touch.js"]
    if is_led:
        bars.insert(0, "hand")
        scripts += [
            "aim.js",
            "section.js",
            "reach.js",
            "hand_input.js",
            "gamepad.js",
            "instruments.js",
            "hand.js",
        ]
    if choices is not None:
        bars.insert(-1, "draw")  # the bar of a small screen scrolls, and shows its begin
        panels.append("choices")
        scripts += ["choices.js", "skin_at_rest.js", "draw.js"]
    return _page(
        title,
        caption,
        [*scripts, "force_plot.js", "live.js"],
        controls="".join(_part(f"{bar}.html") for bar in bars),
        data=f'<script>const TOKEN = "{token}", CHOICES = {_as_script(choices)};</script>',
        style="".join(_part(f"{each}.css") for each in (*bars, *panels)),
        panels="".join(_part(f"{panel}.html") for panel in panels),
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
    controls = _part("player.html")
    page = _page(title, caption, (*_OF_ALL_PAGES, "replay.js"), controls, packets)
    policy = policy_of(page, "data:")  # its packets, as it unpacks them
    return page.replace(_CHARSET, f"{_CHARSET}\n{_POLICY.format(policy)}", 1)


def policy_of(document: str, connections: str) -> str:
    """Return the Content-Security-Policy of a page.

    Its scripts are those of the document, by their hashes. So a text that gets into the page, such
    as the name of a scene, cannot become a script, and nothing is loaded or sent elsewhere.

    Args:
        document: The page. Scripts of a type of their own are data and need no permission.
        connections: Where the page may connect to, as in `connect-src`.
    """
    hashes = " ".join(f"'sha256-{_hash(script)}'" for script in _SCRIPT.findall(document))
    return (
        f"default-src 'none'; script-src {hashes}; style-src 'unsafe-inline'; "
        f"img-src data: blob:; connect-src {connections}; base-uri 'none'; form-action 'none'"
    )


def _page(
    title: str,
    caption: str,
    scripts: Sequence[str],
    controls: str = "",
    data: str = "",
    style: str = "",
    panels: str = "",
) -> str:
    """Return one self-contained HTML document.

    Args:
        title: Heading of the page.
        caption: Text below the heading.
        scripts: Files of its scripts, in order.
        controls: Elements of its bar.
        data: Script elements that come before these.
        style: Rules besides those of all pages.
        panels: Elements next to the picture.
    """
    return Template(_part("page.html")).substitute(
        title=html.escape(title),
        caption=html.escape(caption),
        style=_part("page.css") + style,
        controls=controls,
        panels=panels,
        meshcat=_meshcat_bundle().read_text("utf-8"),
        data=data,
        scripts="\n".join(_part(script) for script in scripts),
    )


def _hash(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()


def _part(name: str) -> str:
    """Return a part of the pages."""
    return (_HERE / name).read_text("utf-8")


def _as_script(choices: Choices | None) -> str:
    """Return choices as a value in a script, in which no tag can end the script."""
    value = None if choices is None else choices._asdict()
    return msgspec.json.encode(value).decode().replace("<", "\\u003c")


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
