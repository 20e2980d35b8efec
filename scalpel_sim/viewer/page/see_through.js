// Links of arms that stand before the tissue, a blade or pads are drawn faint there. What is not to be hidden is
// drawn first and marks its pixels; a link is drawn in full elsewhere, and faintly on the marked ones.
"use strict";

const SEEN = { stencilWrite: true, stencilRef: 1 }; // the mark
const FAINT_LINK = 0.16; // opacity
const ORDERS = { body: -2, end: -1 }; // of drawing: a blade in the tissue leaves that its mark

// How a material of the body, of an end or of a link of an arm treats the marks; null is none of them.
function treatMarks(material, part) {
    if (part === "link") {
        Object.assign(material, SEEN, { stencilFunc: THREE.NotEqualStencilFunc });
    } else if (part !== null) {
        Object.assign(material, SEEN, { stencilFunc: THREE.AlwaysStencilFunc, stencilZPass: THREE.ReplaceStencilOp });
    }
}

// What marks the pixels of tissue that lets light through, which is drawn after the links.
function markOf(mesh) {
    const material = new THREE.MeshBasicMaterial({ colorWrite: false, depthWrite: false, side: THREE.DoubleSide });
    treatMarks(material, "body");
    const mark = new THREE.Mesh(mesh.geometry, material);
    mark.name = "mark";
    mark.renderOrder = ORDERS.body;
    return mark;
}

// Draw a mesh of such a part in its turn; a link has a faint twin.
function drawInTurn(mesh, part, material) {
    mesh.renderOrder = ORDERS[part] ?? 0;
    if (part !== "link" || mesh.children.length > 0) return;
    const faint = material.clone();
    Object.assign(faint, SEEN, {
        stencilFunc: THREE.EqualStencilFunc, transparent: true, opacity: FAINT_LINK * material.opacity,
        depthWrite: false, side: THREE.FrontSide,
    });
    const twin = new THREE.Mesh(mesh.geometry, faint);
    twin.name = "faint";
    mesh.add(twin);
}
