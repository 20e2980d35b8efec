"""Links of pages to files outside of the site lose their link, for the site has no such page."""

import re
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parents[1]
_LINK = re.compile(r"\[([^\]]+)\]\((?!https?:|#)([^)#\s]+)(#[^)]*)?\)")


def on_page_markdown(markdown: str, *, page: Any, **_: Any) -> str:
    """Return the text of a page without links to what lies outside of `docs`, or is a folder."""
    folder = (DOCS / page.file.src_uri).parent

    def kept(link: re.Match[str]) -> str:
        target = (folder / link[2]).resolve()
        is_page = target.is_relative_to(DOCS) and target.is_file()
        return link[0] if is_page else link[1]

    return _LINK.sub(kept, markdown)
