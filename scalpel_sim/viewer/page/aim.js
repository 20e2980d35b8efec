// Where the pointer sends the chosen instrument: in its own plane, so deep under what lies under the pointer. Off
// the body that is the plane itself.
"use strict";

const LEAST_SLOPE = Math.sin(15 * Math.PI / 180); // of the line of sight to the plane: else it is tilted
const FARTHEST_SIGHT = 4; // distance at which a line of sight ends that misses the plane, over that of the tip
const LEAST_STEEP = 0.5; // sine of a slope
const BEFORE = 0.1; // distance from the body at which an edge that lies begins, over its depth
const THROUGH = 1.2, DEEPEST = 1.5; // depth at first and at most, over the height of the body
const RING = { radius: 0.035, light: 0xffffff, dark: 0x18303a }; // radius over the size of the scene

class Aim {
    constructor(view) {
        this.view = view;
        this.viewer = view.viewer;
        this.tool = null; // how the chosen instrument is in the last picture
        this.held = null; // how it was when the pointer took hold
        this.goal = null; // where the tip is sent, scene
        this.depths = new Map(); // of each instrument [m]
        this.ray = new THREE.Raycaster();
        this.mark = aimMark();
        this.viewer.scene.add(this.mark);
        this.viewer.controls.addEventListener("change", () => this.mark.face(this.viewer.camera));
    }

    // A picture says how the chosen instrument is.
    show({ tip, back, length, normal, chosen, closed }) {
        const tool = { tip: turned(tip), back: turned(back), normal: turned(normal), chosen, isBlade: closed === null };
        tool.into = tool.back.clone().negate();
        tool.lead = new THREE.Vector3(); // from what the pointer leads to the tip: of an edge that lies to half of it
        if (tool.isBlade) Object.assign(tool, intoBody(tool, length));
        this.tool = tool;
        if (!this.depths.has(chosen)) this.setDepths(length);
        this.showMark();
    }

    get depth() {
        return this.tool === null ? 0 : this.depths.get(this.tool.chosen).now;
    }

    set depth(metres) {
        const depth = this.depths.get(this.tool.chosen);
        depth.now = Math.min(Math.max(metres, 0), depth.deepest);
        this.showMark();
    }

    get deepest() {
        return this.depths.get(this.tool.chosen).deepest;
    }

    // A blade at first cuts clean through; pads go to what is pointed at.
    setDepths(length) {
        const skin = this.view.tissue.get("skin");
        if (skin === undefined) return;
        skin.mesh.updateWorldMatrix(true, false);
        const { min, max } = new THREE.Box3().setFromObject(skin.mesh);
        const height = max.y - min.y, { chosen, isBlade } = this.tool;
        const deepest = isBlade ? Math.min(DEEPEST * height, length) : length;
        this.depths.set(chosen, { now: isBlade ? Math.min(THROUGH * height, deepest) : 0, deepest });
    }

    // The pointer takes hold, or what it leads was turned: from now on plane and body are those of the picture. A
    // body that the blade dents or lifts would otherwise take the goal along.
    take() {
        const body = [...this.view.tissue.values()].map(still);
        const box = body.reduce((all, mesh) => all.expandByObject(mesh), new THREE.Box3());
        this.held = { ...this.tool, body, box, isIn: false };
    }

    letGo() {
        this.held = this.goal = null;
        this.showMark();
    }

    // Shift the plane by so much along its normal [m].
    shift(metres) {
        if (this.held === null) return;
        this.held.tip = this.held.tip.clone().addScaledVector(this.held.normal, metres);
    }

    // Where the tip is to go in turn [m], world frame, for a place of the window.
    at(clientX, clientY) {
        const { tip, into, normal, lead, isBlade, lies, box, isIn } = this.held;
        const eye = new THREE.Vector3(), way = this.view.sightThrough(clientX, clientY, eye);
        const led = tip.clone().sub(lead).addScaledVector(into, -this.depth);
        const seen = this.bodyOn(eye, way) ?? planeOn(eye, way, led, normal);
        seen.addScaledVector(normal, led.sub(seen).dot(normal));
        const skin = isBlade ? this.skinOver(seen, into) : null;
        if (skin !== null) seen.copy(skin);
        seen.add(lead);
        const goals = [seen.clone().addScaledVector(into, this.depth)];
        if (lies && (skin === null || !isIn)) {
            const before = seen.addScaledVector(into, beginOf(box, into) - BEFORE * this.depth - seen.dot(into));
            if (skin === null) goals.pop(); // beside the body it stays before it
            goals.unshift(before);
        }
        this.held.isIn = skin !== null;
        this.goal = goals[goals.length - 1];
        this.showMark();
        return goals.map(turnedBack);
    }

    // The place of the body on a line of sight; null where there is none.
    bodyOn(eye, way) {
        this.ray.set(eye, way);
        const [nearest] = this.ray.intersectObjects(this.held.body, false);
        return nearest === undefined ? null : nearest.point;
    }

    // The place of the body that a blade enters first on its way into a place; null where there is none.
    skinOver(place, into) {
        const far = FARTHEST_SIGHT * this.view.extent;
        return this.bodyOn(place.clone().addScaledVector(into, -far), into);
    }

    // The ring is where the pointer leads, and a bar goes from there to the tip; at rest the ring is at the tip.
    showMark() {
        if (this.tool === null) return;
        const tip = this.goal === null ? this.tool.tip : this.goal.clone().sub(this.held.lead);
        const led = this.goal === null ? tip : tip.clone().addScaledVector(this.held.into, -this.depth);
        this.mark.place(turnedBack(led), turnedBack(tip), RING.radius * this.view.extent);
        this.mark.face(this.viewer.camera);
        coarseness.showMarks();
    }
}

// Which way a blade goes into the body: straight down in its plane, or along the instrument where that plane lies. An
// edge that lies goes where it cuts, up too, and is led by its middle.
function intoBody({ normal, back, into }, length) {
    const down = new THREE.Vector3(0, -1, 0).projectOnPlane(normal), forward = normal.clone().cross(back);
    const lies = Math.abs(forward.y) > LEAST_STEEP;
    if (lies) return { lies, into: forward, lead: back.clone().multiplyScalar(-0.5 * length) };
    return { lies, into: down.length() > LEAST_STEEP ? down.normalize() : into };
}

// How far along a direction a box begins.
function beginOf({ min, max }, { x, y, z }) {
    return Math.min(x * min.x, x * max.x) + Math.min(y * min.y, y * max.y) + Math.min(z * min.z, z * max.z);
}

// A mesh that stays as the body is now, as it came: it need not be smooth.
function still({ mesh, geometry }) {
    const copy = new THREE.Mesh(new THREE.BufferGeometry(), mesh.material);
    copy.geometry.setAttribute("position", geometry.attributes.position.clone());
    copy.geometry.setIndex(geometry.index.clone());
    mesh.updateWorldMatrix(true, false);
    copy.matrix.copy(mesh.matrixWorld);
    copy.matrixAutoUpdate = false;
    copy.updateMatrixWorld();
    return copy;
}

// The place of a plane on a line of sight. A plane that is seen almost from its edge is tilted.
function planeOn(eye, way, through, normal) {
    const slope = normal.dot(way), plane = normal.clone();
    if (Math.abs(slope) < LEAST_SLOPE) {
        plane.addScaledVector(way, -slope).normalize().multiplyScalar(Math.sqrt(1 - LEAST_SLOPE ** 2));
        plane.addScaledVector(way, slope < 0 ? -LEAST_SLOPE : LEAST_SLOPE);
    }
    const farthest = FARTHEST_SIGHT * eye.distanceTo(through);
    const distance = plane.dot(through.clone().sub(eye)) / plane.dot(way);
    return eye.clone().addScaledVector(way, distance > 0 ? Math.min(distance, farthest) : farthest);
}

// A ring with a bar: `place(led, tip, radius)` in the scene, `face(camera)` turns the ring to the eye.
function aimMark() {
    const paint = (color) => new THREE.MeshBasicMaterial({ color, depthTest: false, transparent: true });
    const [light, dark] = [paint(RING.light), paint(RING.dark)];
    const part = (geometry, material, order) => {
        const mesh = new THREE.Mesh(geometry, material);
        mesh.renderOrder = order;
        return mesh;
    };
    const mark = new THREE.Group(), ring = new THREE.Group();
    ring.add(part(new THREE.TorusGeometry(1, 0.24, 8, 40), dark, 2), part(new THREE.TorusGeometry(1, 0.12, 8, 40), light, 3));
    const rod = new THREE.CylinderGeometry(1, 1, 1, 12).translate(0, 0.5, 0).rotateX(Math.PI / 2); // from 0 to 1 along z
    const bars = [[dark, 0.16, 2], [light, 0.08, 3]].map(([material, width, order]) => ({ bar: part(rod, material, order), width }));
    mark.name = "aim";
    mark.add(ring, ...bars.map(({ bar }) => bar));
    mark.place = (led, tip, radius) => {
        const from = new THREE.Vector3(...led), way = new THREE.Vector3(...tip).sub(from);
        const length = way.length();
        ring.position.copy(from);
        ring.scale.setScalar(radius);
        for (const { bar, width } of bars) {
            bar.visible = length > radius;
            if (!bar.visible) continue;
            bar.position.copy(from).addScaledVector(way, radius / length);
            bar.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), way.clone().divideScalar(length));
            bar.scale.set(width * radius, width * radius, length - radius);
        }
    };
    mark.face = (camera) => ring.lookAt(camera.getWorldPosition(new THREE.Vector3()));
    return mark;
}
