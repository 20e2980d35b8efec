// The view of the scene: meshcat's viewer with shared textured materials, lights that suit the size
// of the scene, and readings.
"use strict";

const WIRE_COLOUR = 0xffe4d8; // on faces
const GRID_COLOURS = { skin: 0x24323a, cut: 0xa3121a }; // of edges without faces
const FAINT = 0.12; // opacity of the skin where the cut is shown alone
const NARROWEST = 0.75; // width of a window over its height, from which on a body fits in as it is
const ABOVE_THE_PANELS = {
    enabled: true, fullWidth: 1, fullHeight: 1, width: 1, height: 1, offsetX: 0, offsetY: 0.06, // of the height
};
const CONTACT_SCALE = 30; // magnification: about thirty contacts along the edge share the force
const SMALLEST_ARROW = 0.02; // [N]; the arrow of a smaller force would be too small to see

// A decoded command keeps its geometry, so that a replay uploads each geometry once.
class SceneView {
    constructor(pane, onReadings, onCameras) {
        this.isSoftware = drawsBySoftware();
        this.viewer = new MeshCat.Viewer(pane, true, makeRenderer(pane, this.isSoftware));
        this.onReadings = onReadings;
        this.onCameras = onCameras;
        this.onHand = () => {};
        this.onRun = () => {};
        this.onPlan = () => {};
        this.onScore = () => {};
        this.cameras = [];
        this.chosen = 0;
        this.room = room();
        this.filteredRoom = this.isSoftware ? null : filtered(this.room, this.viewer.renderer);
        this.appearances = new Map();
        this.parts = new Map(); // which are of links of arms, or of their ends
        this.plain = new Map(); // the same for coarse pictures
        this.isPlain = false;
        this.wires = new Map();
        this.tissue = new Map(); // the meshes of skin and cut, and their geometries as they came
        this.smoothSkin = new SmoothSkin();
        this.isSmooth = true; // whether the skin is drawn by it
        this.colours = new FieldColours();
        this.onScale = () => {};
        this.onLegend = () => {};
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
            set_legend: (command) => this.onLegend(command.entries),
            set_scales: (command) => this.setScales(command.tops),
            set_readings: (command) => this.setReadings(command),
            set_hand: (command) => this.onHand(command),
            set_run: (command) => this.onRun(command),
            set_plan: (command) => this.onPlan(command),
            set_score: (command) => this.onScore(command.rows),
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
        this.lights = new Lights(viewer.scene);
        this.arrow = forceArrow();
        this.contacts = contactLines();
        viewer.scene.add(backdrop(), this.arrow, this.contacts);
        viewer.gui.domElement.id = "scene-tree";
        new ResizeObserver(() => viewer.set_3d_pane_size()).observe(viewer.dom_element);
    }

    setAppearance({ name, kind, properties, maps, part = null }) {
        const redraw = () => this.viewer.set_dirty();
        const described = materialOf(kind, properties, maps, this.room, redraw);
        const material = this.filteredRoom ? richOf(described, this.filteredRoom) : described;
        const plain = plainOf(described);
        for (const each of [material, plain]) treatMarks(each, part);
        this.parts.set(name, part);
        this.appearances.set(name, material);
        this.plain.set(name, plain);
    }

    // Returns whether the object is a mesh with a shared appearance. meshcat handles all others.
    setObject(command) {
        const json = command.object;
        const appearance = json.materials && json.materials[0].name;
        const material = this.materialCalled(appearance);
        if (!material) return false;
        if (command.geometry === undefined) command.geometry = geometryOf(json.geometries[0].data);
        const path = command.path.split("/").filter((part) => part);
        const node = this.viewer.scene_tree.find([...path, "<object>"]);
        if (node.object.isMesh) {
            const { geometry } = (path[0] === "tissue" && this.tissue.get(path[1])) || node.object;
            if (!geometry.isKept) geometry.dispose();
            node.object.geometry = command.geometry;
            node.object.material = material;
        } else {
            const mesh = new THREE.Mesh(command.geometry, material);
            mesh.castShadow = !material.transparent;
            // On thin parts that move a shadow would be stripes: their own.
            mesh.receiveShadow = ["tissue", "stand"].includes(path[0]) || path[1] === "0";
            mesh.name = "<object>";
            node.set_object(mesh);
        }
        node.object.userData.appearance = appearance;
        if (path[0] === "tissue") this.addTissue(path[1], node.object);
        else drawInTurn(node.object, this.parts.get(appearance), material);
        return true;
    }

    // `part` is skin or cut.
    addTissue(part, mesh) {
        let wires = this.wires.get(part);
        if (!wires) {
            wires = new THREE.Mesh(mesh.geometry, new THREE.MeshBasicMaterial({
                wireframe: true, transparent: true, opacity: 0.7,
                polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1,
            }));
            mesh.add(wires, markOf(mesh));
            this.wires.set(part, wires);
        }
        for (const child of mesh.children) child.geometry = mesh.geometry;
        this.tissue.set(part, { mesh, geometry: mesh.geometry });
    }

    // Draw with or without shadows and smooth skin, with plain materials, and with a share of the pixels in each
    // direction.
    setDrawing({ shadows, plain, pixels, smooth }) {
        this.isSmooth = smooth;
        this.lights.lamp.castShadow = shadows;
        this.viewer.renderer.setPixelRatio(pixels * this.fullPixelRatio);
        if (plain !== this.isPlain) {
            this.isPlain = plain;
            this.viewer.scene.traverse((mesh) => {
                const { appearance } = mesh.userData;
                if (appearance !== undefined) mesh.material = this.materialCalled(appearance);
            });
        }
        this.showTissue();
    }

    materialCalled(appearance) {
        return (this.isPlain ? this.plain : this.appearances).get(appearance);
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
        this.showTissue();
        this.onScale(this.colours);
    }

    setScales(tops) {
        this.colours.setTops(tops);
        this.showTissue();
        this.onScale(this.colours);
    }

    // The skin is smooth where no edges are shown, which lie on its triangles.
    shapeTissue(hasEdges) {
        const skin = this.tissue.get("skin"), cut = this.tissue.get("cut");
        if (skin && cut) {
            const isSmooth = this.isSmooth && !hasEdges;
            skin.mesh.geometry = isSmooth ? this.smoothSkin.of(skin.geometry, cut.geometry) : skin.geometry;
        }
        for (const { mesh } of this.tissue.values()) this.colours.paint(mesh.geometry);
    }

    showTissue() {
        const isGrid = this.shown === "grid", isCut = this.shown === "cut";
        this.shapeTissue(isGrid || this.wireframe);
        for (const [part, { mesh }] of this.tissue) {
            const isFaint = isCut && part === "skin";
            const wires = this.wires.get(part);
            wires.visible = isGrid || (this.wireframe && !isFaint);
            wires.material.color.set(isGrid ? GRID_COLOURS[part] : WIRE_COLOUR).convertSRGBToLinear();
            mesh.material = this.colours.isThere
                ? this.colours.materials.get(part)
                : this.materialCalled(mesh.userData.appearance);
            treatMarks(mesh.material, "body");
            drawInTurn(mesh, "body");
            mesh.castShadow = !isFaint;
            const { material } = mesh;
            material.visible = !isGrid; // the edges are children of the mesh, and stay
            material.opacity = isFaint ? FAINT : 1;
            material.transparent = isFaint;
            material.depthWrite = !isFaint;
            setTranslucent(material, !isFaint);
            mesh.getObjectByName("mark").visible = material.transmission > 0;
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
        const { camera, controls } = this.viewer;
        const { clientWidth, clientHeight } = this.viewer.renderer.domElement;
        eye = framed(eye, target, clientWidth / clientHeight);
        const distance = Math.hypot(...eye.map((x, axis) => x - target[axis]));
        camera.view = ABOVE_THE_PANELS;
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
        for (const each of this.appearances.values()) {
            if (each.userData.transmission) each.thickness = JELLY_THICKNESS * extent;
        }
        this.lights.aim(new THREE.Vector3(...target), new THREE.Vector3(...eye), extent);
    }

    // The direction of the line of sight through a place of the window; `eye` becomes its start.
    sightThrough(clientX, clientY, eye) {
        const { camera, renderer } = this.viewer;
        const { left, top, width, height } = renderer.domElement.getBoundingClientRect();
        camera.updateMatrixWorld();
        eye.setFromMatrixPosition(camera.matrixWorld);
        const x = 2 * (clientX - left) / width - 1, y = 1 - 2 * (clientY - top) / height;
        return new THREE.Vector3(x, y, 0.5).unproject(camera).sub(eye).normalize();
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

// A window higher than wide shows less to the sides: there the eye is farther away.
function framed(eye, target, aspect) {
    const farther = Math.max(1, NARROWEST / aspect);
    return eye.map((x, axis) => target[axis] + farther * (x - target[axis]));
}

// Up is z in the scene, and y in three.js.
const turned = ([x, y, z]) => new THREE.Vector3(x, z, -y);
const turnedBack = ({ x, y, z }) => [x, -z, y];

function geometryOf({ attributes, index }) {
    const geometry = new THREE.BufferGeometry();
    geometry.userData.levels = {};
    for (const [name, { array, itemSize, normalized }] of Object.entries(attributes)) {
        if (name in QUANTITIES) geometry.userData.levels[name] = array;
        else if (name === "rest") geometry.userData.rest = array; // no shader reads it
        else geometry.setAttribute(name, new THREE.BufferAttribute(array, itemSize, normalized));
    }
    geometry.userData.tints = geometry.attributes.color;
    geometry.setIndex(new THREE.BufferAttribute(index.array, 1));
    return geometry;
}
