// The skin in the last picture, as it is and at rest: a place that is pointed at is found in the picture, and kept
// as a place at rest, so that it stays in the material that moves. Here and not in the run, because a line is to
// follow the pointer at once, also where the run is slow, stands still or has ended. The run puts the places on the
// skin again, of which it has the last word.
"use strict";

const EDGE_WEIGHT = -1e-6; // by which a line may miss a triangle and still meet it: positions have single precision

class SkinAtRest {
    constructor(view) {
        this.view = view;
    }

    get isThere() {
        const skin = this.view.tissue.get("skin");
        return skin !== undefined && skin.geometry.userData.rest !== undefined;
    }

    get geometry() {
        return this.view.tissue.get("skin").geometry;
    }

    // From the frame of the tissue to that of the picture.
    get matrix() {
        const { mesh } = this.view.tissue.get("skin");
        mesh.updateWorldMatrix(true, false);
        return mesh.matrixWorld;
    }

    // What a line of sight meets first, as a place of the skin; null where that is not skin.
    seenAlong(eye, way) {
        const toTissue = this.matrix.clone().invert();
        const from = eye.clone().applyMatrix4(toTissue), along = way.clone().transformDirection(toTissue);
        const [skin, cut] = ["skin", "cut"].map((part) => {
            const { attributes, index } = this.view.tissue.get(part).geometry;
            return entry(attributes.position.array, index.array, from.toArray(), along.toArray(), (t) => t > 0 ? t : Infinity);
        });
        return skin === null || (cut !== null && cut.t < skin.t) ? null : skin;
    }

    // Where a line along a direction enters the body at rest, nearest to a place on it; null: nowhere.
    at(place, along) {
        return entry(this.geometry.userData.rest, this.geometry.index.array, place, along, Math.abs);
    }

    // A place at rest, and now, both in the frame of the tissue.
    rest(place) {
        return blended(this.geometry.userData.rest, this.geometry.index.array, place);
    }

    now(place) {
        return blended(this.geometry.attributes.position.array, this.geometry.index.array, place);
    }

    // The outward normal at rest.
    normal({ face }) {
        const corners = [0, 1, 2].map((k) => new THREE.Vector3().fromArray(
            this.geometry.userData.rest, 3 * this.geometry.index.array[3 * face + k]));
        return corners[1].sub(corners[0]).cross(corners[2].sub(corners[0])).normalize().toArray();
    }
}

function blended(positions, index, { face, u, v }) {
    const [a, b, c] = [0, 1, 2].map((k) => 3 * index[3 * face + k]);
    return [0, 1, 2].map((k) => (1 - u - v) * positions[a + k] + u * positions[b + k] + v * positions[c + k]);
}

// The triangle through which a line enters a body, where `farness` of the way there is least: its number, the way,
// and the weights of its second and third corner (Moeller and Trumbore 1997).
function entry(positions, index, [ox, oy, oz], [dx, dy, dz], farness) {
    let best = null, least = Infinity;
    for (let i = 0; i < index.length; i += 3) {
        const a = 3 * index[i], b = 3 * index[i + 1], c = 3 * index[i + 2];
        const ax = positions[a], ay = positions[a + 1], az = positions[a + 2];
        const ex = positions[b] - ax, ey = positions[b + 1] - ay, ez = positions[b + 2] - az;
        const fx = positions[c] - ax, fy = positions[c + 1] - ay, fz = positions[c + 2] - az;
        const px = dy * fz - dz * fy, py = dz * fx - dx * fz, pz = dx * fy - dy * fx;
        const facing = ex * px + ey * py + ez * pz;
        if (facing <= 0) continue; // it leaves there, or passes along
        const sx = ox - ax, sy = oy - ay, sz = oz - az;
        const u = (sx * px + sy * py + sz * pz) / facing;
        if (u < EDGE_WEIGHT || u > 1 - EDGE_WEIGHT) continue;
        const qx = sy * ez - sz * ey, qy = sz * ex - sx * ez, qz = sx * ey - sy * ex;
        const v = (dx * qx + dy * qy + dz * qz) / facing;
        if (v < EDGE_WEIGHT || u + v > 1 - EDGE_WEIGHT) continue;
        const t = (fx * qx + fy * qy + fz * qz) / facing, far = farness(t);
        if (far < least) [best, least] = [{ face: i / 3, u, v, t }, far];
    }
    return best;
}
