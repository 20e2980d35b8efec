// Depth, which a picture does not show: how far the body is behind or before the tip, where both are seen
// in one place.
"use strict";

const LOOK_EVERY = 250; // [ms]: a reading takes a millisecond or two for the surface of an organ
const NEAR_ENOUGH = 2e-3; // [m]: the last of the way is seen by the shadow, and felt
const HINT_STEP = 5; // [mm]: a hint that changed with each picture could not be read

class Depth {
    constructor(view) {
        this.view = view;
        this.lookedAt = -Infinity;
        this.found = null;
        this.ray = new THREE.Raycaster();
    }

    // How far beyond the tip the body is [m], along the line of sight through the tip; negative where
    // the body is before the tip, 0 where the tip is in it, null where the line misses it.
    toBody([x, y, z]) {
        const { camera } = this.view.viewer;
        camera.updateMatrixWorld();
        const eye = new THREE.Vector3().setFromMatrixPosition(camera.matrixWorld);
        const way = new THREE.Vector3(x, z, -y).sub(eye); // up is z in the scene, and y in three.js
        const tip = way.length();
        this.ray.set(eye, way.normalize());
        const meshes = [...this.view.tissue.values()].map(({ mesh }) => mesh);
        const hits = this.ray.intersectObjects(meshes, false).map((hit) => hit.distance);
        if (hits.length === 0) return null;
        const near = Math.min(...hits), far = Math.max(...hits);
        return tip < near ? near - tip : Math.min(far - tip, 0);
    }

    // What to do to meet the body, or "" where that is clear.
    hint(tip) {
        const now = performance.now();
        if (now - this.lookedAt > LOOK_EVERY) {
            this.lookedAt = now;
            this.found = this.toBody(tip);
        }
        if (this.found === null || Math.abs(this.found) < NEAR_ENOUGH) return "";
        const distance = Math.max(HINT_STEP * Math.round(Math.abs(1e3 * this.found) / HINT_STEP), HINT_STEP);
        return this.found > 0
            ? `The body is ${distance} mm further away: turn the wheel forwards, or press Page Up`
            : `The body is ${distance} mm nearer to you: turn the wheel back, or press Page Down`;
    }
}
