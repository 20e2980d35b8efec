// Colours of the tissue by displacement, strain or stress, and the scale that they stand for.
"use strict";

// What may be shown: how it is called, and its unit, with how many of them are one in SI.
const QUANTITIES = {
    displacement: { title: "displacement", unit: "mm", factor: 1e3, least: 1e-6 },
    strain: { title: "strain, largest principal", unit: "", factor: 1, least: 1e-4 },
    stress: { title: "stress, von Mises", unit: "kPa", factor: 1e-3, least: 1 },
};

// Viridis of matplotlib, in equal steps: even to the eye, also to one that is colour-blind, and in grey.
const VIRIDIS = (
    "440154 48186a 472d7b 424086 3b528b 33638d 2c728e 26828e 21918c 1fa088 28ae80 3fbc73 5ec962 84d44b " +
    "addc30 d8e219 fde725"
).split(" ").map((hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255));

const DARKEST = 0.8; // factor of the colour on a side that faces down: the shape is seen, the colour kept
const N_STEPS = 256;

// A colour of the scale, from 0 to 1, in sRGB.
function viridis(share) {
    const at = Math.min(Math.max(share, 0), 1) * (VIRIDIS.length - 1);
    const below = Math.min(Math.floor(at), VIRIDIS.length - 2);
    return VIRIDIS[below].map((c, i) => c + (at - below) * (VIRIDIS[below + 1][i] - c));
}

// The next larger of 1, 2 and 5 times a power of ten.
function roundedUp(value) {
    const power = 10 ** Math.floor(Math.log10(value));
    return [1, 2, 5, 10].find((digit) => digit * power >= value * (1 - 1e-9)) * power;
}

class FieldColours {
    constructor() {
        this.quantity = ""; // or a key of QUANTITIES
        this.tops = {}; // in the picture that is shown, SI
        this.highest = {}; // so far: the range only grows, until the quantity is chosen again
        this.keepsRange = false; // or not even then
        this.table = Array.from({ length: N_STEPS }, (_, i) =>
            new THREE.Color(...viridis(i / (N_STEPS - 1))).convertSRGBToLinear());
        this.materials = new Map(["skin", "cut"].map((part) => [part, new THREE.MeshBasicMaterial({
            vertexColors: true, side: THREE.DoubleSide, toneMapped: false,
        })]));
    }

    // Whether the picture has the quantity that was chosen.
    get isThere() {
        return this.quantity in this.tops;
    }

    // Value at the upper end of the scale, SI.
    get range() {
        const { least } = QUANTITIES[this.quantity];
        return roundedUp(Math.max(this.highest[this.quantity] || 0, least));
    }

    choose(quantity) {
        this.quantity = quantity;
        if (!this.keepsRange) this.highest = { ...this.tops };
    }

    setTops(tops) {
        this.tops = tops;
        for (const [name, top] of Object.entries(tops)) {
            this.highest[name] = Math.max(this.highest[name] || 0, top);
        }
    }

    // Give a geometry its colours, or its tints back where it has no such quantity.
    paint(geometry) {
        const { tints, levels } = geometry.userData;
        if (!this.isThere || !levels[this.quantity]) {
            geometry.setAttribute("color", tints);
            return;
        }
        const values = levels[this.quantity], normals = geometry.attributes.normal.array;
        const perLevel = (N_STEPS - 1) * this.tops[this.quantity] / (255 * this.range);
        const colours = new Float32Array(3 * values.length);
        for (let i = 0; i < values.length; i++) {
            const colour = this.table[Math.min(Math.round(perLevel * values[i]), N_STEPS - 1)];
            const up = Math.max(normals[3 * i + 2] / 32767, 0);
            const shade = DARKEST + (1 - DARKEST) * up;
            colours.set([shade * colour.r, shade * colour.g, shade * colour.b], 3 * i);
        }
        geometry.setAttribute("color", new THREE.BufferAttribute(colours, 3));
    }
}
