"""Names of scenes between two processes. The other side may name a folder by one: it is no path."""

import re

LONGEST = 64
"""Longest name [characters]."""

WANTED_NAME = f"1 to {LONGEST} letters, digits, underscores and dashes"
"""What a name is, for messages."""

_NAME = re.compile(f"[A-Za-z0-9_-]{{1,{LONGEST}}}")
_UNNAMED = "tissue"


def is_scene_name(name: str) -> bool:
    """Return whether another process may call its scene that."""
    return _NAME.fullmatch(name) is not None


def sent_scene_name(name: str) -> str:
    """Return a name as another process gets it: what may not be in one is an underscore there."""
    return re.sub(r"[^A-Za-z0-9_-]", "_", name)[:LONGEST] or _UNNAMED
