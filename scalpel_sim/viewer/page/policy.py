"""Policy of a page for its browser: it runs its own scripts, and talks to its own server."""

import base64
import hashlib
import re

PAGE_HEADERS = {
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
}
"""Headers of every answer: the page is for nobody but who asked for it."""

_SCRIPT = re.compile(r"<script>(.*?)</script>", re.DOTALL)


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


def _hash(script: str) -> str:
    return base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
