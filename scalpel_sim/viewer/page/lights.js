// The light of the scene: a lamp that casts shadows, a light on the rim, the sky, and what steel reflects.
"use strict";

// Wet tissue must shine without losing its colour, and a narrow cut must not be black.
const LAMP = { colour: 0xfff1e0, intensity: 0.88 };
const RIM = { colour: 0xbfd4ff, intensity: 0.35 };
const SKY = { above: 0xeaf2f6, below: 0x7a6a62, intensity: 0.8 };

const SHADOW_MAP_PIXELS = 1024; // coarse on purpose: filtering it makes the shadows soft
const SHADOW_WIDTH = 4.4; // of what it covers, over the size of the scene
// A surface is moved by that many pixels of the map along its normal: what is nearly along the light would have
// stripes of its own shadow.
const SHADOW_OFF = 2.5;

class Lights {
    constructor(scene) {
        this.sky = new THREE.HemisphereLight(SKY.above, SKY.below, SKY.intensity);
        this.lamp = new THREE.DirectionalLight(LAMP.colour, LAMP.intensity);
        this.lamp.castShadow = true;
        this.lamp.shadow.mapSize.set(SHADOW_MAP_PIXELS, SHADOW_MAP_PIXELS);
        this.lamp.shadow.radius = 5;
        this.rim = new THREE.DirectionalLight(RIM.colour, RIM.intensity);
        scene.add(this.sky, this.lamp, this.lamp.target, this.rim, this.rim.target);
    }

    // The lamp hangs above and to the left of the camera; the rim light comes from behind the body. All are
    // in the frame of the scene, in which z is up.
    aim(target, eye, extent) {
        const view = eye.clone().sub(target).setZ(0).normalize();
        const left = new THREE.Vector3(view.y, -view.x, 0);
        const up = new THREE.Vector3(0, 0, 1);
        const offset = (a, b, c) => target.clone()
            .addScaledVector(view, a * extent).addScaledVector(left, b * extent).addScaledVector(up, c * extent);
        this.lamp.position.copy(offset(0.9, 0.9, 3.6));
        this.rim.position.copy(offset(-2.5, -1.5, 1.8));
        this.lamp.target.position.copy(target);
        this.rim.target.position.copy(target);
        const { camera } = this.lamp.shadow, half = 0.5 * SHADOW_WIDTH * extent;
        Object.assign(camera, {
            left: -half, right: half, top: half, bottom: -half,
            near: 0.1 * extent, far: 8 * extent,
        });
        camera.updateProjectionMatrix();
        this.lamp.shadow.bias = -0.0004;
        this.lamp.shadow.normalBias = SHADOW_OFF * 2 * half / SHADOW_MAP_PIXELS;
    }
}

// The surroundings that steel and wet tissue reflect: a grey room with lamps under its ceiling. It is
// drawn on six canvases.
function room() {
    const size = 64;
    const paint = (draw) => {
        const canvas = document.createElement("canvas");
        canvas.width = canvas.height = size;
        draw(canvas.getContext("2d"));
        return canvas;
    };
    const wall = paint((context) => {
        const shade = context.createLinearGradient(0, 0, 0, size);
        shade.addColorStop(0.0, "#dfe6e9");
        shade.addColorStop(0.35, "#8b979c");
        shade.addColorStop(0.55, "#6d787c");
        shade.addColorStop(1.0, "#566166");
        context.fillStyle = shade;
        context.fillRect(0, 0, size, size);
        context.filter = "blur(1px)";
        context.fillStyle = "#f4f8fa"; // windows, which a blade that turns shows one after the other
        for (const x of [6, 36]) context.fillRect(x, 14, 12, 30);
    });
    const ceiling = paint((context) => {
        context.fillStyle = "#7d888d";
        context.fillRect(0, 0, size, size);
        context.filter = "blur(3px)";
        context.fillStyle = "#ffffff";
        for (const [x, y] of [[10, 12], [38, 8], [24, 38]]) context.fillRect(x, y, 16, 16);
    });
    const floor = paint((context) => {
        context.fillStyle = "#4a5458";
        context.fillRect(0, 0, size, size);
    });
    const texture = new THREE.CubeTexture([wall, wall, ceiling, floor, wall, wall]);
    texture.encoding = THREE.sRGBEncoding;
    texture.needsUpdate = true;
    return texture;
}

// The same for each roughness, as physically based materials need it: for a card the work of a moment.
function filtered(room, renderer) {
    const generator = new THREE.PMREMGenerator(renderer);
    const { texture } = generator.fromCubemap(room);
    generator.dispose();
    return texture;
}
