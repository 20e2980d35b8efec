// What shows forces in the scene: an arrow for their sum, and a line at each contact.
"use strict";

const ARROW_COLOUR = 0xffb000;
const CONTACT_COLOUR = 0x12509e;
const BEHIND = 0.35; // opacity of what tissue hides

// A second drawing of an object, where it is behind something else.
function faint(object) {
    const twin = object.clone();
    twin.material = object.material.clone();
    Object.assign(twin.material, {
        transparent: true, opacity: BEHIND, depthFunc: THREE.GreaterDepth, depthWrite: false,
    });
    twin.renderOrder = 1;
    return twin;
}

// An arrow along z from the origin: `setSize(length, size)` sets its length and its thickness.
function forceArrow() {
    const material = new THREE.MeshLambertMaterial({
        color: ARROW_COLOUR, emissive: ARROW_COLOUR, transparent: true,
    });
    material.color.convertSRGBToLinear().multiplyScalar(0.45);
    material.emissive.convertSRGBToLinear().multiplyScalar(0.6);
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 20).rotateX(Math.PI / 2), material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 28).rotateX(Math.PI / 2), material);
    const arrow = new THREE.Group();
    arrow.name = "force";
    arrow.add(shaft, head, faint(shaft), faint(head));
    arrow.visible = false;
    arrow.setSize = (length, size) => {
        const tip = Math.min(0.45 * size, 0.6 * length);
        arrow.children.forEach((part, i) => {
            const isShaft = i % 2 === 0;
            const width = isShaft ? 0.055 : 0.15, long = isShaft ? length - tip : tip;
            part.scale.set(width * size, width * size, long);
            part.position.z = isShaft ? long / 2 : length - tip / 2;
        });
    };
    return arrow;
}

// A line at each contact: `setForces(contacts, scale)` takes rows of a point and a force.
function contactLines() {
    const material = new THREE.LineBasicMaterial({ color: CONTACT_COLOUR, transparent: true });
    const lines = new THREE.LineSegments(new THREE.BufferGeometry(), material);
    lines.name = "contacts";
    lines.frustumCulled = false; // the bounds of moving lines would have to be computed again
    const behind = faint(lines);
    behind.frustumCulled = false;
    lines.add(behind);
    lines.setForces = (contacts, scale) => {
        const ends = contacts.slice();
        for (let i = 0; i < ends.length; i += 6) {
            for (const axis of [0, 1, 2]) ends[i + 3 + axis] = ends[i + axis] + scale * ends[i + 3 + axis];
        }
        lines.geometry.dispose();
        lines.geometry = new THREE.BufferGeometry();
        lines.geometry.setAttribute("position", new THREE.BufferAttribute(ends, 3));
        behind.geometry = lines.geometry;
    };
    return lines;
}
