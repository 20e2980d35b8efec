// Lines on the skin: bands that face the eye, lifted so that they are not in the skin.
"use strict";

const LINE_WIDTH = 0.005, LINE_LIFT = 0.004; // over the size of the scene

// `ends` are two for each piece of the line; `wider` is a factor of the usual width.
function ribbon(ends, eye, extent, wider = 1) {
    const corners = [];
    for (let i = 0; i < ends.length; i += 2) {
        const [a, b] = [ends[i], ends[i + 1]];
        const toEye = eye.clone().sub(a).normalize();
        const side = b.clone().sub(a).cross(toEye).normalize().multiplyScalar(0.5 * wider * LINE_WIDTH * extent);
        for (const [end, sign] of [[a, 1], [a, -1], [b, 1], [b, 1], [a, -1], [b, -1]]) {
            const corner = end.clone().addScaledVector(toEye, LINE_LIFT * extent).addScaledVector(side, sign);
            corners.push(corner.x, corner.y, corner.z);
        }
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
    return geometry;
}

// A sheet that hangs from a line: `ends` are two for each piece, `down` its way into the body.
function hanging(ends, down) {
    const corners = [];
    for (let i = 0; i < ends.length; i += 2) {
        const [a, b] = [ends[i], ends[i + 1]], [c, d] = [a.clone().add(down), b.clone().add(down)];
        for (const corner of [a, c, b, b, c, d]) corners.push(corner.x, corner.y, corner.z);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
    return geometry;
}

// A mesh for bands of one colour, whose geometry `draw` replaces. Those of a higher order are drawn later.
function band(name, color, opacity = 1, order = 0) {
    const mesh = new THREE.Mesh(new THREE.BufferGeometry(), new THREE.MeshBasicMaterial({
        color, side: THREE.DoubleSide, transparent: true, opacity, depthWrite: false,
    }));
    mesh.name = name;
    mesh.renderOrder = order;
    mesh.frustumCulled = false;
    mesh.draw = (geometry) => {
        mesh.geometry.dispose();
        mesh.geometry = geometry;
    };
    return mesh;
}
