"""The web pages: meshcat's viewer, this project's picture around it, and what one can press."""

import html
import importlib.util
from pathlib import Path
from string import Template

_HERE = Path(__file__).parent


def live_page(title: str, caption: str) -> str:
    """Return a page that follows a run over a web socket."""
    return _page(title, caption, ("stage.js", "controls.js", "live.js"))


def replay_page(title: str, caption: str, packets: str) -> str:
    """Return a page that plays a run. It needs no network.

    Args:
        title: What was done.
        caption: What one sees.
        packets: The script elements that hold the run.
    """
    controls = (_HERE / "player.html").read_text("utf-8")
    return _page(title, caption, ("stage.js", "controls.js", "replay.js"), controls, packets)


def _page(
    title: str, caption: str, scripts: tuple[str, ...], controls: str = "", data: str = ""
) -> str:
    """Return one self-contained document."""
    return Template((_HERE / "page.html").read_text("utf-8")).substitute(
        title=html.escape(title),
        caption=html.escape(caption),
        style=(_HERE / "page.css").read_text("utf-8"),
        controls=controls,
        meshcat=_meshcat_viewer().read_text("utf-8"),
        data=data,
        scripts="\n".join((_HERE / script).read_text("utf-8") for script in scripts),
    )


def _meshcat_viewer() -> Path:
    """Return meshcat's viewer without importing meshcat, which would import IPython.

    Raises:
        ModuleNotFoundError: meshcat is not installed.
    """
    spec = importlib.util.find_spec("meshcat")
    if spec is None or not spec.submodule_search_locations:
        raise ModuleNotFoundError("meshcat is not installed: pip install meshcat", name="meshcat")
    return Path(spec.submodule_search_locations[0]) / "viewer" / "dist" / "main.min.js"
