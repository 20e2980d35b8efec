// Skin that is drawn smoother than its triangles. Each is divided in four, and again: a new corner lies on the
// curve that the ends of its edge and their normals define (PN triangles). Edges of a cut, where the faces of the
// cut join, and edges at which sides meet, whose normals differ, stay straight.
"use strict";

const N_DIVISIONS = 2;
const MOST_TRIANGLES = 60000; // after them; a body with more is divided less
const FARTHEST = 0.15; // of a new corner from the middle of its edge, over its length, as where skin is folded sharply
const CLOSE = 2; // normals that differ by no more, of 32767 in each axis, are one: they were rounded

// Which vertices of geometries are in one place: a number for each.
function placesOf(positions) {
    let size = 16;
    while (size < 2 * positions.length / 3) size *= 2;
    const bits = new Int32Array(positions.buffer, positions.byteOffset, positions.length);
    const table = new Int32Array(size).fill(-1), places = new Int32Array(positions.length / 3);
    for (let i = 0; i < places.length; i++) {
        const x = bits[3 * i], y = bits[3 * i + 1], z = bits[3 * i + 2];
        const hash = Math.imul(x, 73856093) ^ Math.imul(y, 19349663) ^ Math.imul(z, 83492791);
        let slot = (hash ^ hash >>> 15) & size - 1;
        for (; table[slot] >= 0; slot = slot + 1 & size - 1) {
            const j = table[slot];
            if (bits[3 * j] === x && bits[3 * j + 1] === y && bits[3 * j + 2] === z) break;
        }
        if (table[slot] < 0) table[slot] = i;
        places[i] = table[slot];
    }
    return places;
}

// The edges of the triangles of a skin, and which of them are curved.
function edgesOf(skin, cut) {
    const index = skin.index.array, positions = skin.attributes.position.array, n = positions.length / 3;
    const both = new Float32Array(positions.length + cut.attributes.position.array.length);
    both.set(positions);
    both.set(cut.attributes.position.array, positions.length);
    const places = placesOf(both), nPlaces = both.length / 3;
    const numbers = new Map(); // of an edge, by its vertices
    const ends = [], ofTriangles = new Int32Array(index.length);
    const uses = new Map(); // number of a first edge at two places; -1: it is straight
    const partner = []; // of each edge: the one of the triangle beside it
    const keyOf = (a, b, count) => a < b ? a * count + b : b * count + a;
    const cutIndex = cut.index.array;
    for (let i = 0; i < cutIndex.length; i++) {
        const next = cutIndex[i % 3 === 2 ? i - 2 : i + 1];
        uses.set(keyOf(places[n + cutIndex[i]], places[n + next], nPlaces), -1);
    }
    const isStraight = [], nTriangles = [];
    for (let i = 0; i < index.length; i++) {
        const a = index[i], b = index[i % 3 === 2 ? i - 2 : i + 1], key = keyOf(a, b, n);
        let edge = numbers.get(key);
        if (edge === undefined) {
            edge = partner.length;
            numbers.set(key, edge);
            ends.push(a, b);
            partner.push(-1);
            isStraight.push(false);
            nTriangles.push(0);
            const at = keyOf(places[a], places[b], nPlaces), first = uses.get(at);
            if (first === undefined) uses.set(at, edge);
            else if (first < 0 || partner[first] >= 0) isStraight[edge] = true;
            else [partner[edge], partner[first]] = [first, edge];
            if (first >= 0 && isStraight[edge]) isStraight[first] = isStraight[partner[first]] = true;
        }
        nTriangles[edge] += 1;
        ofTriangles[i] = edge;
    }
    const normals = skin.attributes.normal.array;
    const isOne = (a, b) => [0, 1, 2].every((k) => Math.abs(normals[3 * a + k] - normals[3 * b + k]) <= CLOSE);
    const isCurved = Uint8Array.from(partner, (beside, edge) => {
        if (isStraight[edge]) return 0;
        if (beside < 0) return nTriangles[edge] === 2 ? 1 : 0;
        if (nTriangles[edge] + nTriangles[beside] !== 2) return 0;
        const [a, b] = [ends[2 * edge], ends[2 * edge + 1]];
        let [c, d] = [ends[2 * beside], ends[2 * beside + 1]];
        if (places[a] !== places[c]) [c, d] = [d, c];
        return isOne(a, c) && isOne(b, d) ? 1 : 0;
    });
    return { ends: Int32Array.from(ends), isCurved, ofTriangles };
}

// One division: the new corner of edge e is vertex nVertices + e.
function divided({ ends, isCurved, ofTriangles }, index, nVertices) {
    const nEdges = isCurved.length, nTriangles = index.length / 3;
    const next = {
        ends: new Int32Array(4 * nEdges + 6 * nTriangles),
        isCurved: new Uint8Array(2 * nEdges + 3 * nTriangles).fill(1),
        ofTriangles: new Int32Array(4 * index.length),
    };
    for (let e = 0; e < nEdges; e++) { // its halves are edges 2 e, from its first end, and 2 e + 1
        next.ends[4 * e] = ends[2 * e];
        next.ends[4 * e + 1] = next.ends[4 * e + 2] = nVertices + e;
        next.ends[4 * e + 3] = ends[2 * e + 1];
        next.isCurved[2 * e] = next.isCurved[2 * e + 1] = isCurved[e];
    }
    const corners = new Uint32Array(4 * index.length);
    const half = (edge, end) => 2 * edge + (ends[2 * edge] === end ? 0 : 1);
    for (let t = 0; t < nTriangles; t++) {
        const inner = 2 * nEdges + 3 * t; // the edges between the new corners, of the triangle in the middle
        for (let k = 0; k < 3; k++) { // the triangle at corner k, and one corner and edge of the middle one
            const corner = index[3 * t + k], after = ofTriangles[3 * t + k];
            const before = ofTriangles[3 * t + (k + 2) % 3], at = 12 * t + 3 * k, middle = 12 * t + 9 + k;
            corners[at] = corner;
            corners[at + 1] = corners[middle] = nVertices + after;
            corners[at + 2] = nVertices + before;
            next.ofTriangles[at] = half(after, corner);
            next.ofTriangles[at + 1] = inner + (k + 2) % 3;
            next.ofTriangles[at + 2] = half(before, corner);
            next.ofTriangles[middle] = inner + k;
            next.ends[2 * (inner + k)] = nVertices + after;
            next.ends[2 * (inner + k) + 1] = nVertices + ofTriangles[3 * t + (k + 1) % 3];
        }
    }
    return { edges: next, index: corners, nVertices: nVertices + nEdges };
}

// Fill in the new corners of a division, from `first` on, in an array of some numbers a vertex: their means.
function fillMeans(array, size, { ends }, first) {
    for (let e = 0, at = first * size; e < ends.length; e += 2) {
        const a = ends[e] * size, b = ends[e + 1] * size;
        for (let k = 0; k < size; k++, at++) array[at] = 0.5 * (array[a + k] + array[b + k]);
    }
}

// Fill in positions and normals of the new corners of a division.
function fillCurved(positions, normals, { ends, isCurved }, first) {
    for (let e = 0, at = 3 * first; e < isCurved.length; e++, at += 3) {
        const a = 3 * ends[2 * e], b = 3 * ends[2 * e + 1];
        const dx = positions[b] - positions[a], dy = positions[b + 1] - positions[a + 1];
        const dz = positions[b + 2] - positions[a + 2], square = dx * dx + dy * dy + dz * dz;
        const ax = normals[a] / 32767, ay = normals[a + 1] / 32767, az = normals[a + 2] / 32767;
        const bx = normals[b] / 32767, by = normals[b + 1] / 32767, bz = normals[b + 2] / 32767;
        const fromA = dx * ax + dy * ay + dz * az, fromB = -(dx * bx + dy * by + dz * bz);
        let nx = ax + bx, ny = ay + by, nz = az + bz, x = 0, y = 0, z = 0;
        if (isCurved[e] && square > 0) {
            x = (fromA * ax + fromB * bx) / 8; y = (fromA * ay + fromB * by) / 8; z = (fromA * az + fromB * bz) / 8;
            const far = Math.sqrt((x * x + y * y + z * z) / square);
            if (far > FARTHEST) { x *= FARTHEST / far; y *= FARTHEST / far; z *= FARTHEST / far; }
            const turn = 2 * (fromA - fromB) / square; // the mean normal, reflected: curves may bend both ways
            const mx = nx - turn * dx, my = ny - turn * dy, mz = nz - turn * dz;
            const share = 2 / (Math.sqrt(mx * mx + my * my + mz * mz) || 1);
            nx += share * mx; ny += share * my; nz += share * mz;
        }
        positions[at] = 0.5 * (positions[a] + positions[b]) - x;
        positions[at + 1] = 0.5 * (positions[a + 1] + positions[b + 1]) - y;
        positions[at + 2] = 0.5 * (positions[a + 2] + positions[b + 2]) - z;
        const length = 32767 / (Math.sqrt(nx * nx + ny * ny + nz * nz) || 1);
        normals[at] = length * nx; normals[at + 1] = length * ny; normals[at + 2] = length * nz;
    }
}

function areSame(one, other) {
    if (one.length !== other.length) return false;
    for (let i = 0; i < one.length; i++) if (one[i] !== other[i]) return false;
    return true;
}

class SmoothSkin {
    constructor() {
        this.geometry = new THREE.BufferGeometry();
        this.index = []; // of the skin that it was made for, and of its cut
        this.cutIndex = [];
        this.divisions = [];
    }

    // The smooth twin of the geometry of a skin, which `cut` joins. It is good until the next call.
    of(skin, cut) {
        if (!areSame(this.index, skin.index.array) || !areSame(this.cutIndex, cut.index.array)) this.divide(skin, cut);
        const { attributes, userData } = this.geometry;
        for (const [name, attribute] of Object.entries(skin.attributes)) {
            if (name === "color") continue;
            attributes[name].array.set(attribute.array);
            attributes[name].needsUpdate = true;
        }
        userData.tints.array.set(skin.userData.tints.array);
        userData.tints.needsUpdate = true;
        userData.levels = {};
        for (const [name, levels] of Object.entries(skin.userData.levels)) {
            userData.levels[name] = new Uint8Array(this.nVertices);
            userData.levels[name].set(levels);
        }
        for (const { edges, first } of this.divisions) {
            fillCurved(attributes.position.array, attributes.normal.array, edges, first);
            if (attributes.uv) fillMeans(attributes.uv.array, 2, edges, first);
            fillMeans(userData.tints.array, 3, edges, first);
            for (const levels of Object.values(userData.levels)) fillMeans(levels, 1, edges, first);
        }
        if (skin.boundingSphere === null) skin.computeBoundingSphere();
        this.geometry.boundingSphere = skin.boundingSphere.clone();
        this.geometry.boundingSphere.radius *= 1 + FARTHEST;
        return this.geometry;
    }

    // Only a cut changes which vertices there are.
    divide(skin, cut) {
        this.index = skin.index.array;
        this.cutIndex = cut.index.array;
        this.divisions = [];
        let edges = edgesOf(skin, cut), index = this.index, nVertices = skin.attributes.position.count;
        for (let i = 0; i < N_DIVISIONS && 4 * index.length <= 3 * MOST_TRIANGLES; i++) {
            this.divisions.push({ edges, first: nVertices });
            ({ edges, index, nVertices } = divided(edges, index, nVertices));
        }
        this.nVertices = nVertices;
        this.geometry.dispose();
        this.geometry = new THREE.BufferGeometry();
        const longer = ({ array, itemSize, normalized }) => new THREE.BufferAttribute(
            new array.constructor(itemSize * nVertices), itemSize, normalized,
        );
        for (const [name, attribute] of Object.entries(skin.attributes)) {
            if (name !== "color") this.geometry.setAttribute(name, longer(attribute));
        }
        this.geometry.userData.tints = longer(skin.userData.tints);
        this.geometry.setIndex(new THREE.BufferAttribute(index, 1));
    }
}
