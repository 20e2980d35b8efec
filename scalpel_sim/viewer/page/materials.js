// Materials by their descriptions: each has a plain twin, which coarse pictures are drawn with, and a rich
// one for a graphics card.
"use strict";

// What wet tissue and polished steel are to light. A rough body below a smooth, clear film of moisture.
const WET = {
    roughness: 0.55, metalness: 0, clearcoat: 0.5, clearcoatRoughness: 0.22, envMapIntensity: 0.55,
};
const STEEL_COLOUR = 0xdfe4e8;
const POLISHED = { roughness: 0.24, metalness: 1, envMapIntensity: 1.7 };
const BRUSHED = { roughness: 0.42, metalness: 1, envMapIntensity: 0.75 };
const FINISHES = { wet: WET, steel: POLISHED, brushed: BRUSHED };

const CLOTH_MEAN = 0.75; // of the texture of cloth, linear

// `redraw` is called when a texture has been read.
function materialOf(kind, { finish, ...properties }, maps, room, redraw) {
    const material = new THREE[kind]({ ...properties, side: THREE.DoubleSide });
    material.userData.finish = finish;
    for (const colour of [material.color, material.specular, material.emissive]) {
        if (colour) colour.convertSRGBToLinear();
    }
    if ("reflectivity" in properties) material.envMap = room;
    for (const [property, url] of Object.entries(maps)) {
        const texture = new THREE.TextureLoader().load(url, redraw);
        texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
        texture.anisotropy = 8;
        if (property === "map") texture.encoding = THREE.sRGBEncoding;
        material[property] = texture;
    }
    return material;
}

// The same of physically based materials, as a card draws them at little cost; `room` is what they reflect,
// filtered by roughness. Paint stays as it is.
function richOf(material, room) {
    const finish = FINISHES[material.userData.finish];
    if (finish === undefined) return material;
    const rich = new THREE.MeshPhysicalMaterial({ ...finish, envMap: room, side: THREE.DoubleSide });
    for (const property of ["vertexColors", "map", "bumpMap", "bumpScale"]) rich[property] = material[property];
    rich.color.copy(finish.metalness > 0 ? new THREE.Color(STEEL_COLOUR).convertSRGBToLinear() : material.color);
    rich.emissive.copy(material.emissive);
    return rich;
}

// The same without relief, reflection and gloss, lit at the vertices: a picture by software takes a
// quarter of the time.
function plainOf(material) {
    const plain = new THREE.MeshLambertMaterial();
    for (const property of ["side", "vertexColors", "map", "alphaMap", "opacity", "transparent"]) {
        plain[property] = material[property];
    }
    plain.color.copy(material.color);
    if (material.userData.finish === "cloth") { // it covers half of a window
        plain.map = null;
        plain.color.multiplyScalar(CLOTH_MEAN);
    }
    if (material.emissive) plain.emissive.copy(material.emissive);
    return plain;
}
