// The view of the scene: meshcat's viewer with shared textured materials, lights that suit the size
// of the scene, and readings.
"use strict";

const { THREE } = MeshCat;

// Wet tissue must shine without losing its colour, and a narrow cut must not be black.
const LAMP = { colour: 0xfff1e0, intensity: 0.88 };
const RIM = { colour: 0xbfd4ff, intensity: 0.35 };
const SKY = { above: 0xeaf2f6, below: 0x7a6a62, intensity: 0.8 };
const EXPOSURE = 1.0;

const SHADOW_MAP_PIXELS = 1024; // coarse on purpose: filtering it makes the shadows soft
const WIRE_COLOUR = 0xffe4d8; // on faces
const GRID_COLOURS = { skin: 0x24323a, cut: 0xa3121a }; // of edges without faces
const FAINT = 0.12; // opacity of the skin where the cut is shown alone
const ARROW_COLOUR = 0xffb000;
const CONTACT_COLOUR = 0x12509e;
const CONTACT_SCALE = 30; // magnification: about thirty contacts along the edge share the force
const SMALLEST_ARROW = 0.02; // [N]; the arrow of a smaller force would be too small to see

// A decoded command keeps its geometry, so that a replay uploads each geometry once.
class SceneView {
    constructor(pane, onReadings, onCameras) {
        this.viewer = new MeshCat.Viewer(pane);
        this.onReadings = onReadings;
        this.onCameras = onCameras;
        this.onHand = () => {};
        this.onRun = () => {};
        this.cameras = [];
        this.chosen = 0;
        this.appearances = new Map();
        this.wires = new Map();
        this.tissue = new Map(); // the meshes of skin and cut
        this.colours = new FieldColours();
        this.onScale = () => {};
        this.wireframe = false;
        this.shown = "faces"; // or "grid", or "cut": see setShown
        this.showsContacts = true;
        this.prepare();
        const meshcatHandles = this.viewer.handle_command.bind(this.viewer);
        const own = {
            batch: (command) => command.commands.forEach((c) => this.viewer.handle_command(c)),
            set_appearance: (command) => this.setAppearance(command),
            set_object: (command) => this.setObject(command) || meshcatHandles(command),
            set_cameras: (command) => this.setCameras(command),
            set_wireframe: (command) => this.setWireframe(command.on),
            set_scales: (command) => this.setScales(command.tops),
            set_readings: (command) => this.setReadings(command),
            set_hand: (command) => this.onHand(command),
            set_run: (command) => this.onRun(command),
        };
        this.viewer.handle_command = (command) => {
            (own[command.type] || meshcatHandles)(command);
            this.viewer.set_dirty();
        };
    }

    prepare() {
        const { viewer } = this;
        for (const path of [["Grid"], ["Axes"], ["Lights"], ["Background"]]) {
            viewer.set_property(path, "visible", false);
        }
        viewer.hide_background();
        this.fullPixelRatio = viewer.renderer.getPixelRatio();
        viewer.renderer.setClearAlpha(0); // the page shows through as the background
        viewer.renderer.outputEncoding = THREE.sRGBEncoding;
        viewer.renderer.toneMapping = THREE.ACESFilmicToneMapping;
        viewer.renderer.toneMappingExposure = EXPOSURE;
        this.room = room();
        this.sky = new THREE.HemisphereLight(SKY.above, SKY.below, SKY.intensity);
        this.lamp = new THREE.DirectionalLight(LAMP.colour, LAMP.intensity);
        this.lamp.castShadow = true;
        this.lamp.shadow.mapSize.set(SHADOW_MAP_PIXELS, SHADOW_MAP_PIXELS);
        this.lamp.shadow.radius = 5;
        this.rim = new THREE.DirectionalLight(RIM.colour, RIM.intensity);
        this.arrow = forceArrow();
        this.contacts = contactLines();
        viewer.scene.add(this.sky, this.lamp, this.lamp.target, this.rim, this.rim.target);
        viewer.scene.add(this.arrow, this.contacts);
        viewer.gui.domElement.id = "scene-tree";
        new ResizeObserver(() => viewer.set_3d_pane_size()).observe(viewer.dom_element);
    }

    setAppearance({ name, kind, properties, maps }) {
        const material = new THREE[kind]({ ...properties, side: THREE.DoubleSide });
        for (const colour of [material.color, material.specular, material.emissive]) {
            if (colour) colour.convertSRGBToLinear();
        }
        if ("reflectivity" in properties) material.envMap = this.room;
        for (const [property, url] of Object.entries(maps)) {
            const texture = new THREE.TextureLoader().load(url, () => this.viewer.set_dirty());
            texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
            texture.anisotropy = 8;
            if (property === "map") texture.encoding = THREE.sRGBEncoding;
            material[property] = texture;
        }
        this.appearances.set(name, material);
    }

    // Returns whether the object is a mesh with a shared appearance. meshcat handles all others.
    setObject(command) {
        const json = command.object;
        const material = json.materials && this.appearances.get(json.materials[0].name);
        if (!material) return false;
        if (command.geometry === undefined) command.geometry = geometryOf(json.geometries[0].data);
        const path = command.path.split("/").filter((part) => part);
        const node = this.viewer.scene_tree.find([...path, "<object>"]);
        if (node.object.isMesh) {
            if (!node.object.geometry.isKept) node.object.geometry.dispose();
            node.object.geometry = command.geometry;
            node.object.material = material;
        } else {
            const mesh = new THREE.Mesh(command.geometry, material);
            mesh.castShadow = !material.transparent;
            mesh.receiveShadow = true;
            mesh.name = "<object>";
            node.set_object(mesh);
        }
        if (path[0] === "tissue") this.addTissue(path[1], node.object, material);
        return true;
    }

    // `part` is skin or cut; `material` is what it looks like where it shows no quantity.
    addTissue(part, mesh, material) {
        let wires = this.wires.get(part);
        if (!wires) {
            wires = new THREE.Mesh(mesh.geometry, new THREE.MeshBasicMaterial({
                wireframe: true, transparent: true, opacity: 0.7,
                polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1,
            }));
            mesh.add(wires);
            this.wires.set(part, wires);
        }
        wires.geometry = mesh.geometry;
        this.tissue.set(part, { mesh, material });
        this.showTissue();
    }

    // Draw with or without shadows, and with a share of the pixels in each direction.
    setDrawing({ shadows, pixels }) {
        this.lamp.castShadow = shadows;
        this.viewer.renderer.setPixelRatio(pixels * this.fullPixelRatio);
        this.viewer.set_dirty();
    }

    setWireframe(on) {
        this.wireframe = on;
        this.showTissue();
    }

    // What is drawn of the tissue: its faces; the grid of all edges, those of the far side too; or the
    // faces of the cut, with a faint skin around them.
    setShown(shown) {
        this.shown = shown;
        this.showTissue();
    }

    // A quantity as colours; "" for none.
    setQuantity(quantity) {
        this.colours.choose(quantity);
        this.paintTissue();
    }

    setScales(tops) {
        this.colours.setTops(tops);
        this.paintTissue();
    }

    paintTissue() {
        for (const { mesh } of this.tissue.values()) this.colours.paint(mesh.geometry);
        this.showTissue();
        this.onScale(this.colours);
    }

    showTissue() {
        const isGrid = this.shown === "grid", isCut = this.shown === "cut";
        for (const [part, { mesh, material: textured }] of this.tissue) {
            const isFaint = isCut && part === "skin";
            const wires = this.wires.get(part);
            wires.visible = isGrid || (this.wireframe && !isFaint);
            wires.material.color.set(isGrid ? GRID_COLOURS[part] : WIRE_COLOUR).convertSRGBToLinear();
            mesh.material = this.colours.isThere ? this.colours.materials.get(part) : textured;
            mesh.castShadow = !isFaint;
            const { material } = mesh;
            material.visible = !isGrid; // the edges are children of the mesh, and stay
            material.opacity = isFaint ? FAINT : 1;
            material.transparent = isFaint;
            material.depthWrite = !isFaint;
        }
        this.viewer.set_dirty();
    }

    setCameras({ cameras, extent }) {
        this.cameras = cameras;
        this.extent = extent;
        this.chooseCamera(0);
        this.onCameras(cameras);
    }

    chooseCamera(number) {
        this.chosen = number;
        this.setCamera(this.cameras[number], this.extent);
        this.viewer.set_dirty();
    }

    // Up is z in the scene and y in three.js. meshcat turns the scene; the camera is turned here.
    setCamera({ eye, target, up, fov }, extent) {
        const turned = ([x, y, z]) => new THREE.Vector3(x, z, -y);
        const { camera, controls } = this.viewer;
        const distance = Math.hypot(...eye.map((x, axis) => x - target[axis]));
        camera.position.copy(turned(eye));
        camera.up.copy(turned(up)).normalize();
        camera.fov = fov;
        camera.near = Math.min(extent, distance) / 100;
        camera.far = extent * 100 + distance;
        camera.updateProjectionMatrix();
        controls.target.copy(turned(target));
        controls.minDistance = Math.min(extent / 10, distance);
        controls.maxDistance = Math.max(extent * 20, distance);
        controls.update();
        this.light(new THREE.Vector3(...target), new THREE.Vector3(...eye), extent);
    }

    // The lamp hangs above and to the left of the camera; the rim light comes from behind the body.
    light(target, eye, extent) {
        const view = eye.clone().sub(target).setZ(0).normalize();
        const left = new THREE.Vector3(view.y, -view.x, 0);
        const up = new THREE.Vector3(0, 0, 1);
        const offset = (a, b, c) => target.clone()
            .addScaledVector(view, a * extent).addScaledVector(left, b * extent).addScaledVector(up, c * extent);
        this.lamp.position.copy(offset(0.9, 0.9, 3.6));
        this.rim.position.copy(offset(-2.5, -1.5, 1.8));
        this.lamp.target.position.copy(target);
        this.rim.target.position.copy(target);
        const camera = this.lamp.shadow.camera;
        Object.assign(camera, {
            left: -2.2 * extent, right: 2.2 * extent, top: 2.2 * extent, bottom: -2.2 * extent,
            near: 0.1 * extent, far: 8 * extent,
        });
        camera.updateProjectionMatrix();
        this.lamp.shadow.bias = -0.0004;
        this.lamp.shadow.normalBias = 0.003 * extent;
    }

    setReadings(readings) {
        const force = new THREE.Vector3(...readings.force);
        const newtons = force.length();
        this.arrow.visible = newtons > SMALLEST_ARROW;
        if (this.arrow.visible) {
            const length = newtons * readings.newton_length;
            this.arrow.position.set(...readings.point);
            this.arrow.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), force.normalize());
            this.arrow.setSize(length, 0.1 * readings.newton_length / 0.15);
        }
        this.contacts.setForces(readings.contacts.array, CONTACT_SCALE * readings.newton_length);
        this.contacts.visible = this.showsContacts;
        this.onReadings({ ...readings, newtons });
    }

    setContacts(on) {
        this.showsContacts = this.contacts.visible = on;
        this.viewer.set_dirty();
    }
}

function geometryOf({ attributes, index }) {
    const geometry = new THREE.BufferGeometry();
    geometry.userData.levels = {};
    for (const [name, { array, itemSize, normalized }] of Object.entries(attributes)) {
        if (name in QUANTITIES) geometry.userData.levels[name] = array;
        else geometry.setAttribute(name, new THREE.BufferAttribute(array, itemSize, normalized));
    }
    geometry.userData.tints = geometry.attributes.color;
    geometry.setIndex(new THREE.BufferAttribute(index.array, 1));
    return geometry;
}

// An arrow along z from the origin: `setSize(length, size)` sets its length and its thickness.
function forceArrow() {
    const material = new THREE.MeshLambertMaterial({
        color: ARROW_COLOUR, emissive: ARROW_COLOUR,
        depthTest: false, transparent: true, // visible through the tissue around the tip
    });
    material.color.convertSRGBToLinear().multiplyScalar(0.45);
    material.emissive.convertSRGBToLinear().multiplyScalar(0.6);
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 20).rotateX(Math.PI / 2), material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 28).rotateX(Math.PI / 2), material);
    const arrow = new THREE.Group();
    arrow.name = "force";
    arrow.add(shaft, head);
    arrow.visible = false;
    shaft.renderOrder = head.renderOrder = 1;
    arrow.setSize = (length, size) => {
        const tip = Math.min(0.45 * size, 0.6 * length);
        shaft.scale.set(0.055 * size, 0.055 * size, length - tip);
        shaft.position.z = (length - tip) / 2;
        head.scale.set(0.15 * size, 0.15 * size, tip);
        head.position.z = length - tip / 2;
    };
    return arrow;
}

// A line at each contact: `setForces(contacts, scale)` takes rows of a point and a force.
function contactLines() {
    const material = new THREE.LineBasicMaterial({
        color: CONTACT_COLOUR, depthTest: false, transparent: true,
    });
    const lines = new THREE.LineSegments(new THREE.BufferGeometry(), material);
    lines.name = "contacts";
    lines.frustumCulled = false; // the bounds of moving lines would have to be computed again
    lines.renderOrder = 1;
    lines.setForces = (contacts, scale) => {
        const ends = contacts.slice();
        for (let i = 0; i < ends.length; i += 6) {
            for (const axis of [0, 1, 2]) ends[i + 3 + axis] = ends[i + axis] + scale * ends[i + 3 + axis];
        }
        lines.geometry.dispose();
        lines.geometry = new THREE.BufferGeometry();
        lines.geometry.setAttribute("position", new THREE.BufferAttribute(ends, 3));
    };
    return lines;
}

// The surroundings that steel and wet tissue reflect: a grey room with lamps under its ceiling. It is
// drawn on six canvases, because filtering a rendered room takes seconds without a graphics card.
function room() {
    const size = 64;
    const paint = (draw) => {
        const canvas = document.createElement("canvas");
        canvas.width = canvas.height = size;
        draw(canvas.getContext("2d"));
        return canvas;
    };
    const wall = paint((context) => {
        const shade = context.createLinearGradient(0, 0, 0, size);
        shade.addColorStop(0.0, "#dfe6e9");
        shade.addColorStop(0.35, "#8b979c");
        shade.addColorStop(0.55, "#4c5659");
        shade.addColorStop(1.0, "#262c2f");
        context.fillStyle = shade;
        context.fillRect(0, 0, size, size);
    });
    const ceiling = paint((context) => {
        context.fillStyle = "#7d888d";
        context.fillRect(0, 0, size, size);
        context.filter = "blur(3px)";
        context.fillStyle = "#ffffff";
        for (const [x, y] of [[10, 12], [38, 8], [24, 38]]) context.fillRect(x, y, 16, 16);
    });
    const floor = paint((context) => {
        context.fillStyle = "#23292c";
        context.fillRect(0, 0, size, size);
    });
    const texture = new THREE.CubeTexture([wall, wall, ceiling, floor, wall, wall]);
    texture.encoding = THREE.sRGBEncoding;
    texture.needsUpdate = true;
    return texture;
}
