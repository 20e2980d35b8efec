"""Draw the pictures of the gallery anew: python docs/site/pictures.py [NAME ...]."""

import subprocess
import sys
import tempfile
from pathlib import Path

from PIL import Image

GALLERY = Path(__file__).parents[1] / "gallery"
NAMES = ("organ", "retract", "gallbladder", "layers", "tumour", "10", "11", "12")
"""Those that `scalpel-sim figure` draws."""
WIDTH = 960
"""Of a picture [pixels]: two panels of a page."""
QUALITY = 80
"""Of WebP: a picture has some 20 to 60 kB."""


def main() -> None:
    """Draw the pictures that are named, or all."""
    for name in sys.argv[1:] or NAMES:
        with tempfile.TemporaryDirectory() as folder:
            drawn = Path(folder) / f"{name}.png"
            program = [sys.executable, "-m", "scalpel_sim"]
            subprocess.run([*program, "figure", "-q", name, "--output", str(drawn)], check=True)
            with Image.open(drawn) as image:
                image = image.convert("RGB")
                image.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
                image.save(GALLERY / f"{name}.webp", quality=QUALITY, method=6)


if __name__ == "__main__":
    main()
