// Materials by their descriptions: each has a plain twin, which coarse pictures are drawn with, and a rich
// one for a graphics card.
"use strict";

// What wet tissue and polished steel are to light. A rough body below a smooth, clear film of moisture.
const WET = {
    roughness: 0.55, metalness: 0, clearcoat: 0.5, clearcoatRoughness: 0.22, envMapIntensity: 0.55,
};
const CUT = { ...WET, roughness: 0.42, clearcoat: 1, clearcoatRoughness: 0.12, envMapIntensity: 0.7 }; // it has just bled
const JELLY = { roughness: 0.3, ior: 1.34, clearcoat: 0.6, clearcoatRoughness: 0.1 };
const JELLY_THICKNESS = 0.25; // through which light goes, over the size of the scene
const STEEL_COLOUR = 0xdfe4e8;
const POLISHED = { roughness: 0.24, metalness: 1, envMapIntensity: 1.7 };
const BRUSHED = { roughness: 0.42, metalness: 1, envMapIntensity: 0.75 };
const FINISHES = { wet: WET, cut: CUT, steel: POLISHED, brushed: BRUSHED };

const CLOTH_MEAN = 0.75; // of the texture of cloth, linear

// `redraw` is called when a texture has been read.
function materialOf(kind, { finish, translucency = 0, ...properties }, maps, room, redraw) {
    const material = new THREE[kind]({ ...properties, side: THREE.DoubleSide });
    Object.assign(material.userData, { finish, translucency });
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
    const { translucency } = material.userData;
    if (translucency > 0) {
        rich.userData.transmission = translucency;
        Object.assign(rich, JELLY, { transmission: translucency });
    }
    return rich;
}

// Let light through a material that may, or not, as where it is drawn faint.
function setTranslucent(material, isTranslucent) {
    const transmission = isTranslucent ? material.userData.transmission : 0;
    if (transmission === undefined || transmission === material.transmission) return;
    material.transmission = transmission;
    material.needsUpdate = true;
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
