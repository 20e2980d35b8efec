"""Draw the pictures of the gallery anew: python docs/site/pictures.py [NAME ...]."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

GALLERY = Path(__file__).parents[1] / "gallery"
NAMES = ("organ", "retract", "gallbladder", "layers", "tumour", "10", "11", "12")
"""Those that `scalpel-sim figure` draws."""
LIVE = "live"
"""Name of that of the live page, for which Chromium and Playwright are needed."""
LIVE_SCENE, LIVE_SECONDS = "gallbladder", 2.4
"""Scene on the live page, and the instant at which it is shown [s]."""
WINDOW = {"width": 1280, "height": 800}
"""Window of the live page [pixels]."""
IS_TIME = "seconds => parseFloat(document.getElementById('time').textContent) >= seconds"
IS_FINE = "() => !document.body.classList.contains('coarse')"
"""Conditions for which the page is waited, in its own terms."""
FOR_THE_RUN = 300_000
"""Longest time for it [ms]."""
WIDTH = 960
"""Of a picture [pixels]: two panels of a page."""
QUALITY = 80
"""Of WebP: a picture has some 20 to 60 kB."""
PROGRAM = [sys.executable, "-m", "scalpel_sim"]


def main() -> None:
    """Draw the pictures that are named, or all."""
    for name in sys.argv[1:] or (*NAMES, LIVE):
        with tempfile.TemporaryDirectory() as folder:
            drawn = Path(folder) / f"{name}.png"
            if name == LIVE:
                show_live(drawn, Path(folder) / "run")
            else:
                subprocess.run([*PROGRAM, "figure", "-q", name, "--output", str(drawn)], check=True)
            with Image.open(drawn) as image:
                image = image.convert("RGB")
                image.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
                image.save(GALLERY / f"{name}.webp", quality=QUALITY, method=6)


def show_live(path: Path, folder: Path) -> None:
    """Write what the live page shows as an arm cuts."""
    from playwright.sync_api import sync_playwright

    words = ["view", LIVE_SCENE, "--out", str(folder)]
    run = subprocess.Popen([*PROGRAM, *words], stderr=subprocess.PIPE, text=True)
    try:
        assert run.stderr is not None
        address = next(found[0] for line in run.stderr if (found := re.search(r"http\S+", line)))
        with sync_playwright() as driver:
            browser = driver.chromium.launch(
                executable_path="/usr/bin/chromium",
                args=["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"],
            )
            tab = browser.new_page(viewport=WINDOW, bypass_csp=True)
            tab.goto(address)
            tab.wait_for_function(IS_TIME, arg=LIVE_SECONDS, timeout=FOR_THE_RUN)
            tab.get_by_role("button", name="pause").click()
            tab.wait_for_function(IS_FINE, timeout=FOR_THE_RUN)
            tab.wait_for_timeout(1000)
            tab.screenshot(path=path)
            browser.close()
    finally:
        run.kill()


if __name__ == "__main__":
    main()
