// The sliders: how much of the edge is beyond the pointer, and how far the plane has been moved sideways.
"use strict";

class Reach {
    constructor(hand) {
        this.hand = hand;
        this.home = null; // tip at first, and the normal that points to the right, of the chosen instrument
        this.sideways = 0; // [m], as asked for
        document.querySelector("#looks").before(element("reach"));
        for (const [id, change] of [
            ["depth", (metres) => this.setDepth(metres)], ["sideways", (metres) => this.setSideways(metres)],
        ]) {
            element(id).addEventListener("input", (event) => change(event.target.value / 1e3));
        }
    }

    // A picture says where the instrument is: after an undo elsewhere than asked for.
    show({ tip, normal, chosen }) {
        if (this.home === null || this.home.chosen !== chosen) {
            const right = new THREE.Vector3().setFromMatrixColumn(this.hand.viewer.camera.matrixWorld, 0);
            const sign = turned(normal).dot(right) < 0 ? -1 : 1;
            this.home = { chosen, tip: turned(tip), normal: turned(normal).multiplyScalar(sign) };
        }
        const { aim, unshown } = this.hand;
        element("depth").max = Math.floor(1e3 * aim.deepest);
        if (unshown.length === 0) this.sideways = turned(tip).sub(this.home.tip).dot(this.home.normal);
        this.write("depth", aim.depth, unshown.length === 0);
        this.write("sideways", this.sideways, unshown.length === 0);
    }

    write(id, metres, isSet) {
        const millimetres = Math.round(2e3 * metres) / 2 + 0; // no -0
        if (isSet && document.activeElement !== element(id)) element(id).value = millimetres;
        element(`${id}-value`).textContent = `${millimetres.toFixed(1)} mm`;
        element(id).setAttribute("aria-valuetext", `${millimetres.toFixed(1)} millimetres`);
    }

    // Lead the tip so deep; under a pointer that holds the edge the tip goes deeper.
    setDepth(metres, stamp = performance.now()) {
        const { hand } = this, { aim } = hand, before = aim.depth;
        if (!hand.isClosed) return;
        aim.depth = metres;
        if (aim.held !== null) return hand.aimAgain(stamp);
        hand.step("depth", aim.tool.into.clone().multiplyScalar(aim.depth - before), stamp);
    }

    setSideways(metres, stamp = performance.now()) {
        const { hand } = this, by = metres - this.sideways;
        if (!hand.isClosed) return;
        this.sideways = metres;
        if (hand.aim.held !== null) {
            hand.aim.shift(by * Math.sign(this.home.normal.dot(hand.aim.held.normal)));
            return hand.aimAgain(stamp);
        }
        hand.step("sideways", this.home.normal.clone().multiplyScalar(by), stamp);
    }

    enable(isEnabled) {
        for (const id of ["depth", "sideways"]) element(id).disabled = !isEnabled;
    }
}
