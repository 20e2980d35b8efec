// A gamepad that leads the chosen instrument, by the browser's Gamepad API. Left stick: in the plane of
// the screen. Right stick: up and down the depth, sideways turns. A: releases while it is pressed. B or the
// right trigger: closes the jaws, or opens them. X: chooses the next instrument.
"use strict";

const STICK_SPEED = 0.06; // of a stick that is pressed to its end [m/s]: an unhurried incision
const STICK_TURN_RATE = 1.0; // [rad/s]
const DEAD_ZONE = 0.12; // of a stick that nobody touches
const LONGEST_PAUSE = 0.1; // [s]: after a longer one of the page the blade does not leap

const A = 0, B = 1, X = 2, RIGHT_TRIGGER = 7; // numbers of buttons in the standard layout

function listenToGamepads(hand) {
    let before = null;
    const pressedBefore = new Map(); // of each gamepad, whether its buttons were pressed
    const poll = (now) => {
        const seconds = before === null ? 0 : Math.min((now - before) / 1000, LONGEST_PAUSE);
        before = now;
        for (const pad of navigator.getGamepads()) {
            if (!pad || !pad.connected) continue;
            press(pad);
            lead(pad, seconds, now);
        }
        requestAnimationFrame(poll);
    };
    const press = (pad) => {
        const old = pressedBefore.get(pad.index) ?? [];
        const pressed = pad.buttons.map((button) => button.pressed);
        pressedBefore.set(pad.index, pressed);
        const isNew = (button) => pressed[button] && old[button] === false;
        if (isNew(X)) hand.instruments.chooseNext();
        if (isNew(B) || isNew(RIGHT_TRIGGER)) hand.instruments.toggleJaws();
    };
    const lead = (pad, seconds, now) => {
        const [x, y, turn, depth] = pad.axes.map(withoutDeadZone);
        const letsGo = pad.buttons.length > A && pad.buttons[A].pressed;
        if (letsGo) hand.letGo("gamepad");
        if (letsGo || !(x || y || turn || depth)) return;
        hand.hold("gamepad", true);
        if (x || y || depth) {
            hand.move([x, -y, -depth || 0].map((part) => part * STICK_SPEED * seconds), now);
        }
        if (turn) hand.turn([0, turn * STICK_TURN_RATE * seconds, 0], now);
    };
    requestAnimationFrame(poll);
}

function withoutDeadZone(deflection) {
    const size = Math.abs(deflection);
    return size < DEAD_ZONE ? 0 : Math.sign(deflection) * (size - DEAD_ZONE) / (1 - DEAD_ZONE);
}
