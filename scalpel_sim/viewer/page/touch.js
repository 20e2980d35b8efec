// Two fingers: they let go of what is led, turn the view and zoom.
"use strict";

const TURN_PER_FINGER_PIXEL = 0.006; // [rad]
const HIGHEST_POLE = 0.05; // how near to straight above or below the eye comes [rad]

class TwoFingers {
    constructor(viewer) {
        this.viewer = viewer;
        this.fingers = new Map(); // the places of those on the picture
    }

    get isTurning() {
        return this.fingers.size > 1;
    }

    down({ pointerId, clientX, clientY }) {
        this.fingers.set(pointerId, [clientX, clientY]);
    }

    up({ pointerId }) {
        this.fingers.delete(pointerId);
    }

    move({ pointerId, clientX, clientY }) {
        if (!this.fingers.has(pointerId)) return;
        const before = this.gesture();
        this.fingers.set(pointerId, [clientX, clientY]);
        const after = this.gesture();
        if (before === null) return;
        this.look(after.x - before.x, after.y - before.y, before.spread / after.spread);
    }

    // Middle and distance of the first two fingers; null where there are fewer.
    gesture() {
        if (!this.isTurning) return null;
        const [[ax, ay], [bx, by]] = this.fingers.values();
        return { x: (ax + bx) / 2, y: (ay + by) / 2, spread: Math.max(Math.hypot(ax - bx, ay - by), 1) };
    }

    // Turn the eye about what it looks at by so many pixels, and change its distance.
    look(right, down, farther) {
        const { camera, controls } = this.viewer;
        const offset = camera.position.clone().sub(controls.target);
        const at = new THREE.Spherical().setFromVector3(offset);
        at.theta -= right * TURN_PER_FINGER_PIXEL;
        at.phi = Math.min(Math.max(at.phi - down * TURN_PER_FINGER_PIXEL, HIGHEST_POLE), Math.PI - HIGHEST_POLE);
        at.radius = Math.min(Math.max(at.radius * farther, controls.minDistance), controls.maxDistance);
        camera.position.copy(controls.target).add(offset.setFromSpherical(at));
        controls.update();
        this.viewer.set_dirty();
    }
}
