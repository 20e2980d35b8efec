// A gamepad that leads the blade, by the browser's Gamepad API. Left stick: in the plane of the screen.
// Right stick: up and down the depth, sideways turns. A: lets go while it is pressed.
"use strict";

const STICK_SPEED = 0.06; // of a stick that is pressed to its end [m/s]: an unhurried incision
const STICK_TURN_RATE = 1.0; // [rad/s]
const DEAD_ZONE = 0.12; // of a stick that nobody touches
const LONGEST_PAUSE = 0.1; // [s]: after a longer one of the page the blade does not leap

function listenToGamepads(hand) {
    let before = null;
    const poll = (now) => {
        const seconds = before === null ? 0 : Math.min((now - before) / 1000, LONGEST_PAUSE);
        before = now;
        for (const pad of navigator.getGamepads()) {
            if (pad && pad.connected) lead(pad, seconds, now);
        }
        requestAnimationFrame(poll);
    };
    const lead = (pad, seconds, now) => {
        const [x, y, turn, depth] = pad.axes.map(withoutDeadZone);
        const letsGo = pad.buttons.length > 0 && pad.buttons[0].pressed;
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
