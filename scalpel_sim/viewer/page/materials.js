// Materials by their descriptions: each has a plain twin, which coarse pictures are drawn with.
"use strict";

// `redraw` is called when a texture has been read.
function materialOf(kind, properties, maps, room, redraw) {
    const material = new THREE[kind]({ ...properties, side: THREE.DoubleSide });
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

// The same without relief, reflection and gloss, lit at the vertices: a picture by software takes a
// quarter of the time.
function plainOf(material) {
    const plain = new THREE.MeshLambertMaterial();
    for (const property of ["side", "vertexColors", "map", "alphaMap", "opacity", "transparent"]) {
        plain[property] = material[property];
    }
    plain.color.copy(material.color);
    if (material.emissive) plain.emissive.copy(material.emissive);
    return plain;
}
