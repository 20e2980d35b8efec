// Mouse, touch, wheel and keys that lead the blade. Keys report to the hand how far to move or to turn, in
// the axes of the view: to the right, up, and away from the eye.
"use strict";

const TURN_PER_PIXEL = 0.0044; // [rad]: a quarter of a degree
const DEPTH_PER_WHEEL_PIXEL = 1e-5; // [m]: a notch of the wheel, 100 pixels, is a millimetre
const PIXELS_PER_LINE = 33; // of a wheel that counts lines
const FINEST_WAY = 6; // between two places that a browser reports at once [pixels]
const FINE_STEP = 5e-4; // [m], of a key
const FINE_TURN = 0.02; // [rad]

const STEPS = {
    ArrowRight: [1, 0, 0], ArrowLeft: [-1, 0, 0], ArrowUp: [0, 1, 0], ArrowDown: [0, -1, 0],
    PageUp: [0, 0, 1], PageDown: [0, 0, -1],
};

// A press and a drag send the instrument to what lies under the pointer; with Shift they turn it. A second
// finger lets go of it.
function listenToPointer(pane, canvas, hand) {
    let last = null;
    const { fingers } = hand;
    pane.addEventListener("pointerdown", (event) => {
        if (event.button !== 0 || event.ctrlKey || event.target !== canvas || !hand.isClosed) return;
        event.stopPropagation(); // it does not turn the view
        if (event.pointerType === "touch") fingers.down(event);
        if (fingers.isTurning) {
            if (last !== null) hand.letGo("pointer");
            hand.aim.letGo();
            last = null;
            return;
        }
        if (last !== null) return;
        last = event;
        pane.setPointerCapture(event.pointerId);
        hand.hold("pointer");
        if (!event.shiftKey) hand.aimAt(event.clientX, event.clientY, event.timeStamp);
    }, { capture: true });
    pane.addEventListener("pointermove", (event) => {
        if (fingers.isTurning) {
            event.stopPropagation();
            return fingers.move(event);
        }
        if (last === null || event.pointerId !== last.pointerId) return;
        event.stopPropagation();
        fingers.move(event);
        const right = event.clientX - last.clientX, up = last.clientY - event.clientY;
        last = event;
        if (event.shiftKey) {
            hand.aim.letGo();
            hand.turn([-up * TURN_PER_PIXEL, right * TURN_PER_PIXEL, 0], event.timeStamp);
        } else {
            for (const each of placesOf(event)) hand.aimAt(each.clientX, each.clientY, event.timeStamp);
        }
    }, { capture: true });
    for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
        pane.addEventListener(end, (event) => {
            fingers.up(event);
            if (last === null || event.pointerId !== last.pointerId) return;
            last = null;
            hand.finish("pointer");
        }, { capture: true });
    }
    pane.addEventListener("wheel", (event) => {
        if (event.ctrlKey || event.target !== canvas || !hand.isClosed) return;
        event.stopPropagation();
        event.preventDefault();
        // With Shift browsers turn the wheel sideways.
        const pixels = (event.deltaY || event.deltaX) * (event.deltaMode === 0 ? 1 : PIXELS_PER_LINE);
        const { reach, aim } = hand, metres = -pixels * DEPTH_PER_WHEEL_PIXEL;
        if (event.shiftKey) reach.setSideways(reach.sideways + metres, event.timeStamp);
        else reach.setDepth(aim.depth + metres, event.timeStamp);
    }, { capture: true, passive: false });
}

// The places of a move of the pointer. Where pictures are few, a browser reports many of them at once: the instrument
// goes along all, and cuts no corner.
function placesOf(event) {
    const places = [event];
    const before = event.getCoalescedEvents?.() ?? []; // only pages that nobody can listen to are told
    for (const each of before.reverse()) {
        const { clientX, clientY } = places[0];
        if (Math.hypot(each.clientX - clientX, each.clientY - clientY) >= FINEST_WAY) places.unshift(each);
    }
    return places;
}

function listenToKeys(hand) {
    window.addEventListener("keydown", (event) => {
        const { target, key } = event;
        if (event.ctrlKey || event.altKey || event.metaKey) return;
        if (target instanceof Element && target.matches("select, input")) return; // they are its own
        if (key === " " && !(target instanceof Element && target.matches("button"))) {
            event.preventDefault();
            hand.toggleClutch();
        }
        if (key === "x" && !event.repeat) hand.instruments.chooseNext();
        if (key === "j" && !event.repeat) hand.instruments.toggleJaws();
        if (key in STEPS && hand.isClosed) {
            event.preventDefault();
            const [right, up, away] = STEPS[key];
            hand.hold("keys", true);
            if (event.shiftKey) {
                hand.turn([-up, right, away].map((part) => part * FINE_TURN), event.timeStamp);
            } else {
                hand.move([right, up, away].map((part) => part * FINE_STEP), event.timeStamp);
            }
        }
    });
}
