"""Colours of the pages, light and dark: what is written can be read."""

import re
from pathlib import Path

import pytest

import scalpel_sim.viewer.page

STYLE = (Path(scalpel_sim.viewer.page.__file__).parent / "page.css").read_text(encoding="utf-8")
LIGHT, DARK = re.findall(r":root \{(.*?)\}", STYLE, re.DOTALL)
BEHIND = {"light": "#dfe7e8", "dark": "#ffffff"}
"""The brightest thing behind a panel; in the light style the wall, which is behind most."""
ENOUGH = 4.5
"""Least contrast of text, by WCAG 2.2, 1.4.3."""


def colours(block):
    return dict(re.findall(r"--([\w-]+): (#\w+|rgba\([^)]*\))", block))


def channels(colour, behind=(0.0, 0.0, 0.0)):
    if colour.startswith("rgba"):
        *rgb, alpha = map(float, re.findall(r"[\d.]+", colour))
        return [alpha * c + (1.0 - alpha) * b for c, b in zip(rgb, behind, strict=True)]
    digits = colour[1:] if len(colour) == 7 else "".join(2 * c for c in colour[1:])
    return [float(c) for c in bytes.fromhex(digits)]


def luminance(rgb):
    shares = [c / 255.0 for c in rgb]
    linear = [s / 12.92 if s <= 0.04045 else ((s + 0.055) / 1.055) ** 2.4 for s in shares]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]


def contrast(one, other):
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize(("scheme", "block"), [("light", LIGHT), ("dark", DARK)])
@pytest.mark.parametrize("text", ["ink", "soft", "met", "missed", "link"])
def test_text_on_a_panel_has_enough_contrast(scheme, block, text):
    found = colours(block)
    for panel in ("panel", "dense"):
        under = channels(found[panel], channels(BEHIND[scheme]))
        assert contrast(channels(found[text]), under) >= ENOUGH


@pytest.mark.parametrize("block", [LIGHT, DARK], ids=["light", "dark"])
def test_buttons_can_be_read_also_those_that_are_off(block):
    found = colours(block)
    assert contrast(channels(found["ink"]), channels(found["field"])) >= ENOUGH
    assert contrast(channels(found["soft"]), channels(found["off"])) >= ENOUGH


def test_both_schemes_choose_the_same_colours():
    """The fields of one that the other lacks would be read in the colours of the first."""
    assert colours(LIGHT).keys() == colours(DARK).keys()
