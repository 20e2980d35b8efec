// The line in which the plane of the blade crosses the skin: along it the blade cuts.
"use strict";

const LOOK_EVERY = 250; // [ms]: a crossing takes a millisecond or two for the surface of an organ
const LINE_COLOUR = 0xffffff;

class Section {
    constructor(view) {
        this.view = view;
        this.lookedAt = -Infinity;
        this.isMissed = false; // whether the plane passes next to the body
        this.line = band("section", LINE_COLOUR, 0.75);
        view.viewer.scene.add(this.line);
    }

    // A picture says where the plane is; `isShown`: whether there is one.
    show({ tip, normal }, isShown) {
        this.line.visible = isShown;
        const now = performance.now();
        const skin = this.view.tissue.get("skin");
        if (!isShown || skin === undefined || now - this.lookedAt < LOOK_EVERY) return;
        this.lookedAt = now;
        const { scene, camera } = this.view.viewer;
        skin.mesh.updateWorldMatrix(true, false);
        const toScene = scene.matrixWorld.clone().invert().multiply(skin.mesh.matrixWorld);
        const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(
            new THREE.Vector3(...normal), new THREE.Vector3(...tip),
        );
        const { ends, isMissed } = crossings(skin.geometry, plane.applyMatrix4(toScene.clone().invert()));
        for (const end of ends) end.applyMatrix4(toScene);
        this.isMissed = isMissed; // a body in two halves is on both sides of it
        const eye = scene.worldToLocal(camera.getWorldPosition(new THREE.Vector3()));
        this.line.draw(ribbon(ends, eye, this.view.extent));
    }
}

// The ends of the pieces in which a plane crosses the triangles of a geometry, two for each, and whether all of
// them are on one side.
function crossings(geometry, plane) {
    const at = geometry.attributes.position.array, { array: index } = geometry.index;
    const { normal: { x, y, z }, constant } = plane;
    const heights = new Float32Array(at.length / 3);
    for (let i = 0; i < heights.length; i += 1) {
        heights[i] = x * at[3 * i] + y * at[3 * i + 1] + z * at[3 * i + 2] + constant;
    }
    const ends = [];
    for (let i = 0; i < index.length; i += 3) {
        for (const [a, b] of [[0, 1], [1, 2], [2, 0]]) {
            const p = index[i + a], q = index[i + b];
            if ((heights[p] < 0) === (heights[q] < 0)) continue;
            const share = heights[p] / (heights[p] - heights[q]);
            const [from, to] = [p, q].map((each) => new THREE.Vector3().fromArray(at, 3 * each));
            ends.push(from.lerp(to, share));
        }
    }
    return { ends, isMissed: heights.every((height) => height < 0 === heights[0] < 0) };
}
