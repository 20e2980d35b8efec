"""A visitor presses where the hint says and drags across the body: the first drag cuts it."""

import json
import time

import numpy as np
import pytest

from scalpel_sim import SCENES
from scalpel_sim.runs.file_names import SUMMARY
from tests.scalpel_sim.hands.driven_view import DrivenView, assert_a_run_repeats
from tests.scalpel_sim.hands.test_driven_page import end, eye_at_rest, tip, until_it_rests
from tests.support.browser import TIMEOUT, pixels_of, set_visible

pytestmark = [pytest.mark.end_to_end, pytest.mark.browser]

SIZES = {"desk": (1400, 900), "tablet": (900, 1200), "phone": (390, 800)}
"""Widths and heights of windows [pixels]; the last two have touch."""

LEAST_CUT = 200e-6
"""Area that the first drag has cut at least [m2]."""

SMALL_CUTS = {"skin": 40e-6, "excise": 140e-6}
"""Where it is less [m2]: half of the section of `skin`, which has 80 mm2. A drag that ends at the
edge of the body leaves the last of it, which tough skin carries along. In `excise`, 8 mm high, a
level drag goes along 20 to 30 mm of the line."""

KINDS = [("organ", "desk"), ("skin", "phone"), ("gelatin", "tablet"), ("retract", "phone")]
"""One scene and window of each kind: a blade that stands, through an organ and through a sheet; an
edge that lies, and cuts down or up."""

REPEATED = ("skin", "retract", "grid2")
"""Scenes in which a run of the record is compared with what was led."""

ALL = [(scene, size) for scene in SCENES for size in SIZES]
"""Scenes and sizes of `pytest --long`."""

STEPS, PAUSE = 20, 0.04
"""Moves of a drag, and the time between two of them [s]."""

MARGIN = 4
"""How far inside its outline the body is pressed [pixels]."""

ON_SCREEN = """() => {
    // Places of the body in the window.
    const { mesh } = sceneView.tissue.get("skin");
    mesh.updateWorldMatrix(true, false);
    viewer.camera.updateMatrixWorld();
    const { left, top, width, height } = viewer.renderer.domElement.getBoundingClientRect();
    const { position } = mesh.geometry.attributes;
    return Array.from({ length: position.count }, (_, i) => {
        const at = new THREE.Vector3().fromBufferAttribute(position, i);
        at.applyMatrix4(mesh.matrixWorld).project(viewer.camera);
        return [left + width * (1 + at.x) / 2, top + height * (1 - at.y) / 2];
    });
}"""

COVERED = """(places) => places.filter(
    ([x, y]) => document.elementFromPoint(x, y) !== viewer.renderer.domElement).length"""


def pytest_generate_tests(metafunc):
    if metafunc.function is test_the_first_drag_cuts_each_scene_that_can_be_led:
        cases = ALL if metafunc.config.getoption("long") else KINDS
        metafunc.parametrize(("view", "size"), cases, indirect=["view"])


@pytest.fixture
def view(tmp_path, request):
    with DrivenView(request.param, tmp_path / "led") as led:
        yield led


@pytest.fixture
def opened(browser):
    """Open the page of a view in a window of a size; the test fails if a script in it fails."""
    contexts, failures = [], []

    def open_page(view, size):
        width, height = SIZES[size]
        touch = size != "desk"
        context = browser.new_context(
            viewport={"width": width, "height": height}, has_touch=touch, bypass_csp=True
        )
        contexts.append(context)
        tab = context.new_page()
        tab.failures = failures
        tab.set_default_timeout(TIMEOUT)
        tab.on("pageerror", lambda error: failures.append(str(error)))
        tab.goto(view.url)
        tab.wait_for_function("hand.tip !== null && run.leads && sceneView.tissue.has('skin')")
        return tab

    yield open_page
    for context in contexts:
        context.close()
    assert failures == []


def places_of_the_body(tab):
    return np.array(tab.evaluate(ON_SCREEN))


def across_the_body(tab):
    """Return the ends of a level line across the middle of the body in the window [pixels]."""
    low, high = np.array([(p := places_of_the_body(tab)).min(axis=0), p.max(axis=0)])
    middle = 0.5 * (low[1] + high[1])
    return (low[0] + MARGIN, middle), (high[0] - MARGIN, middle)


class Finger:
    """Fingers on the page."""

    def __init__(self, tab):
        self._device = tab.context.new_cdp_session(tab)

    def put(self, kind, *places):
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
        self._device.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})


def drag(tab, start, stop, is_touch):
    """Press, drag straight and let go."""
    way = [np.add(start, share * np.subtract(stop, start)) for share in np.linspace(0, 1, STEPS)]
    finger = Finger(tab) if is_touch else None
    for i, (x, y) in enumerate(way):
        if finger is not None:
            finger.put("touchStart" if i == 0 else "touchMove", (x, y))
        else:
            tab.mouse.move(x, y)
            if i == 0:
                tab.mouse.down()
        time.sleep(PAUSE)
    if finger is not None:
        finger.put("touchEnd")
    else:
        tab.mouse.up()
    until_it_rests(tab)


def cut_area(view):
    return json.loads((view.folder / SUMMARY).read_text())["cut_area_m2"]


def worse_than_minor(tab):
    """Return what axe-core finds in the page beyond minor."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright").Axe()
    found = axe.run(tab).response["violations"]
    return [(each["id"], each["impact"]) for each in found if each["impact"] != "minor"]


def test_the_first_drag_cuts_each_scene_that_can_be_led(view, opened, size, request, tmp_path):
    name = request.node.callspec.params["view"]
    tab = opened(view, size)
    touch = size != "desk"
    hint = tab.inner_text("#hint")
    assert hint.startswith("Put a finger on the body" if touch else "Press on the body")
    assert ("Two fingers" in hint) == touch
    assert worse_than_minor(tab) == []
    places = places_of_the_body(tab)
    assert tab.evaluate(COVERED, places[:: len(places) // 50].tolist()) == 0
    drag(tab, *across_the_body(tab), touch)
    assert tab.is_hidden("#hint")
    end(tab, view)
    assert cut_area(view) > SMALL_CUTS.get(name, LEAST_CUT)
    if name in REPEATED:
        assert_a_run_repeats(view.folder, tmp_path / "again")


@pytest.mark.parametrize("view", ["grid2"], indirect=True)
def test_two_fingers_turn_and_zoom_and_let_go_of_the_blade(view, opened):
    tab = opened(view, "phone")
    finger = Finger(tab)
    eye = np.array(eye_at_rest(tab))
    (x, y), _ = across_the_body(tab)
    finger.put("touchStart", (x, y))
    tab.wait_for_function("hand.isEngaged")
    finger.put("touchStart", (x, y), (x + 60, y))
    assert not tab.evaluate("hand.isEngaged")
    for step in range(1, 11):
        finger.put("touchMove", (x + 6 * step, y), (x + 60 + 9 * step, y))
    finger.put("touchEnd")
    until_it_rests(tab)
    turned = np.array(eye_at_rest(tab))
    target = np.array(tab.evaluate("viewer.controls.target.toArray()"))
    before, after = eye - target, turned - target
    assert np.linalg.norm(after) < 0.8 * np.linalg.norm(before), "fingers apart: nearer"
    angle = np.arccos(before @ after / np.linalg.norm(before) / np.linalg.norm(after))
    assert angle > 0.1


@pytest.mark.parametrize("view", ["grid2"], indirect=True)
def test_sliders_lead_the_tip_deeper_and_sideways_by_what_they_say(view, opened):
    tab = opened(view, "phone")

    def moved_by(slider, millimetres):
        before = tip(tab)
        tab.evaluate(
            """([id, by]) => {
                const slider = element(id);
                slider.value = Number(slider.value) + by;
                slider.dispatchEvent(new Event("input", { bubbles: true }));
            }""",
            [slider, millimetres],
        )
        until_it_rests(tab)
        return 1e3 * (tip(tab) - before)

    assert moved_by("sideways", 5.0) @ [1.0, 0.0, 0.0] == pytest.approx(5.0, abs=0.5)
    assert moved_by("depth", -5.0) == pytest.approx([0.0, 0.0, 5.0], abs=0.5), "up"


@pytest.mark.parametrize("view", ["grid2"], indirect=True)
def test_a_link_before_the_body_is_drawn_faint(view, opened):
    tab = opened(view, "desk")
    tab.evaluate("""() => {
        // Look from behind the stylus at the body.
        let stylus = null;
        viewer.scene.traverse((each) => { if (each.name === "faint") stylus = each.parent; });
        const box = new THREE.Box3().setFromObject(stylus), at = box.getCenter(new THREE.Vector3());
        const away = at.clone().sub(viewer.controls.target).setLength(3 * sceneView.extent);
        viewer.camera.position.copy(viewer.controls.target).add(away);
        viewer.controls.update();
        viewer.set_dirty();
    }""")
    eye_at_rest(tab)
    set_visible(tab, "stand", False)  # a dark tray behind a dark body looks like it through a link
    seen = len(pixels_of(tab, "tissue/skin"))
    set_visible(tab, "bodies", False)
    bare = len(pixels_of(tab, "tissue/skin"))
    assert seen > 0.9 * bare
