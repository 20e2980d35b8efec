"""Times how late the picture is: from a movement of the mouse to the picture that contains it.

Usage: PYTHONPATH=. python benchmarks/lag.py [SCENE ...], on an idle machine with Chromium

A mouse leads the blade in the live page in a headless Chromium, which draws by software: 480 x 360
pixels, a movement every 15 ms. Each lag ends when the browser has drawn the picture.
"""

import sys
import tempfile
import time
from pathlib import Path

from playwright.sync_api import sync_playwright

from tests.scalpel_sim.hands.driven_view import DrivenView
from tests.support.browser import DETERMINISTIC, NAMES, WINDOW, first_installed

N_MOVES = 400
SECONDS_PER_MOVE = 0.015
SETTLING = 2.0
"""Until the page has found how coarsely it has to draw [s]."""


def main() -> None:
    """Print the times."""
    for scene in sys.argv[1:] or ("grid2", "organ"):
        with tempfile.TemporaryDirectory() as folder, DrivenView(scene, Path(folder)) as view:
            lags, pace = lags_in(view.url)
        median, late = (lags[round(share * (len(lags) - 1))] for share in (0.5, 0.99))
        print(f"{scene}: {len(lags)} inputs, median {median:.0f} ms, 99 % {late:.0f} ms; {pace}")


def lags_in(url: str) -> tuple[list[float], str]:
    """Return the lags in order [ms], and what the page says of the speed of the run."""
    with sync_playwright() as driver:
        chromium = driver.chromium.launch(
            executable_path=first_installed(NAMES), args=list(DETERMINISTIC)
        )
        # It waits for texts, which the policy of the page lets nobody evaluate.
        tab = chromium.new_page(viewport=WINDOW, bypass_csp=True)
        tab.goto(url)
        tab.wait_for_function("hand.isClosed")
        x, y = WINDOW["width"] / 2, 0.45 * WINDOW["height"]
        tab.mouse.move(x, y)
        tab.mouse.down()
        for i in range(round(SETTLING / SECONDS_PER_MOVE)):
            tab.mouse.move(x + i % 3, y)
            time.sleep(SECONDS_PER_MOVE)
        tab.evaluate("hand.lags.length = 0")
        for i in range(N_MOVES):
            way = 60.0 * (i % 100) / 100.0
            tab.mouse.move(x + way, y + way)
            time.sleep(SECONDS_PER_MOVE)
        tab.wait_for_function("hand.unshown.length === 0")
        found, pace = sorted(tab.evaluate("hand.lags")), tab.inner_text("#pace")
        tab.close()
        chromium.close()
    return found, pace


if __name__ == "__main__":
    main()
