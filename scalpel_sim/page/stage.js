// The picture: meshcat's viewer, with shared textured materials, light for its size, and readings.
"use strict";

const { THREE } = MeshCat;

// A window must not be dazzling and a slit must not be black: an overcast room, with a bright lamp.
const LAMP = { colour: 0xfff4e6, intensity: 2.1 };
const RIM = { colour: 0xbfd4ff, intensity: 0.7 };
const ROOM_INTENSITY = 0.75;
const EXPOSURE = 0.95;

const SHADOW_MAP_PIXELS = 2048;
const WIRE_COLOUR = 0x1b0f0e;
const ARROW_COLOUR = 0xffc533;
const FORCE_WORTH_AN_ARROW = 0.02; // [N]; below it the arrow would be a speck

// A decoded packet keeps its geometries, so that a replay uploads each of them once.
class Picture {
    constructor(pane, onReadings) {
        this.viewer = new MeshCat.Viewer(pane);
        this.onReadings = onReadings;
        this.looks = new Map();
        this.wires = new Map();
        this.wireframe = false;
        this.prepare();
        const ofMeshcat = this.viewer.handle_command.bind(this.viewer);
        const own = {
            batch: (command) => command.commands.forEach((c) => this.viewer.handle_command(c)),
            set_look: (command) => this.setLook(command),
            set_object: (command) => this.setObject(command) || ofMeshcat(command),
            set_camera: (command) => this.setCamera(command),
            set_wireframe: (command) => this.setWireframe(command.on),
            set_readings: (command) => this.setReadings(command),
        };
        this.viewer.handle_command = (command) => {
            (own[command.type] || ofMeshcat)(command);
            this.viewer.set_dirty();
        };
    }

    prepare() {
        const { viewer } = this;
        for (const path of [["Grid"], ["Axes"], ["Lights"], ["Background"]]) {
            viewer.set_property(path, "visible", false);
        }
        viewer.hide_background();
        viewer.renderer.setClearAlpha(0); // the page behind is the backdrop
        viewer.renderer.outputEncoding = THREE.sRGBEncoding;
        viewer.renderer.toneMapping = THREE.ACESFilmicToneMapping;
        viewer.renderer.toneMappingExposure = EXPOSURE;
        viewer.scene.environment = room(viewer.renderer);
        this.lamp = new THREE.DirectionalLight(LAMP.colour, LAMP.intensity);
        this.lamp.castShadow = true;
        this.lamp.shadow.mapSize.set(SHADOW_MAP_PIXELS, SHADOW_MAP_PIXELS);
        this.lamp.shadow.radius = 5;
        this.rim = new THREE.DirectionalLight(RIM.colour, RIM.intensity);
        this.arrow = forceArrow();
        viewer.scene.add(this.lamp, this.lamp.target, this.rim, this.rim.target, this.arrow);
        new ResizeObserver(() => viewer.set_3d_pane_size()).observe(viewer.dom_element);
    }

    setLook({ name, kind, properties, maps }) {
        const material = new THREE[kind]({ ...properties, side: THREE.DoubleSide });
        material.color.convertSRGBToLinear();
        for (const [property, url] of Object.entries(maps)) {
            const texture = new THREE.TextureLoader().load(url, () => this.viewer.set_dirty());
            texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
            texture.anisotropy = 8;
            if (property === "map") texture.encoding = THREE.sRGBEncoding;
            material[property] = texture;
        }
        if ("envMapIntensity" in material) material.envMapIntensity = ROOM_INTENSITY;
        if (material.metalness === 1) material.envMapIntensity = 1.6;
        this.looks.set(name, material);
    }

    // Returns whether the object is a mesh with a shared look. Others are meshcat's business.
    setObject(command) {
        const json = command.object;
        const look = json.materials && this.looks.get(json.materials[0].name);
        if (!look) return false;
        const kept = command.geometry !== undefined;
        if (!kept) command.geometry = geometryOf(json.geometries[0].data);
        const path = command.path.split("/").filter((part) => part);
        const node = this.viewer.scene_tree.find([...path, "<object>"]);
        if (node.object.isMesh) {
            if (!node.object.geometry.isKept) node.object.geometry.dispose();
            node.object.geometry = command.geometry;
            node.object.material = look;
        } else {
            const mesh = new THREE.Mesh(command.geometry, look);
            mesh.castShadow = !look.transparent;
            mesh.receiveShadow = true;
            mesh.name = "<object>";
            node.set_object(mesh);
        }
        if (path[0] === "tissue") this.addWires(node.object);
        return true;
    }

    addWires(mesh) {
        let wires = this.wires.get(mesh.uuid);
        if (!wires) {
            const material = new THREE.MeshBasicMaterial({
                color: WIRE_COLOUR, wireframe: true, transparent: true, opacity: 0.55,
                polygonOffset: true, polygonOffsetFactor: -1, polygonOffsetUnits: -1,
            });
            wires = new THREE.Mesh(mesh.geometry, material);
            this.wires.set(mesh.uuid, wires);
            mesh.add(wires);
        }
        wires.geometry = mesh.geometry;
        wires.visible = this.wireframe;
    }

    setWireframe(on) {
        this.wireframe = on;
        for (const wires of this.wires.values()) wires.visible = on;
        this.viewer.set_dirty();
    }

    // The scene is turned so that its z is up, which is y in three.js; the camera is not.
    setCamera({ eye, target, extent }) {
        const up = ([x, y, z]) => new THREE.Vector3(x, z, -y);
        const { camera, controls } = this.viewer;
        camera.position.copy(up(eye));
        camera.fov = 38;
        camera.near = extent / 100;
        camera.far = extent * 100;
        camera.updateProjectionMatrix();
        controls.target.copy(up(target));
        controls.minDistance = extent / 10;
        controls.maxDistance = extent * 20;
        controls.update();
        this.light(new THREE.Vector3(...target), new THREE.Vector3(...eye), extent);
        this.home = { eye, target, extent };
    }

    // The lamp hangs over the left shoulder of who looks; the rim light comes from behind the body.
    light(target, eye, extent) {
        const view = eye.clone().sub(target).setZ(0).normalize();
        const left = new THREE.Vector3(view.y, -view.x, 0);
        const up = new THREE.Vector3(0, 0, 1);
        const away = (a, b, c) => target.clone()
            .addScaledVector(view, a * extent).addScaledVector(left, b * extent).addScaledVector(up, c * extent);
        this.lamp.position.copy(away(0.7, 1.3, 3.2));
        this.rim.position.copy(away(-2.5, -1.5, 1.8));
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
        this.arrow.visible = newtons > FORCE_WORTH_AN_ARROW;
        if (this.arrow.visible) {
            const length = newtons * readings.newton_length;
            this.arrow.position.set(...readings.point);
            this.arrow.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), force.normalize());
            this.arrow.point(length, 0.1 * readings.newton_length / 0.15);
        }
        this.onReadings({ ...readings, newtons });
    }
}

function geometryOf({ attributes, index }) {
    const geometry = new THREE.BufferGeometry();
    for (const [name, { array, itemSize, normalized }] of Object.entries(attributes)) {
        geometry.setAttribute(name, new THREE.BufferAttribute(array, itemSize, normalized));
    }
    geometry.setIndex(new THREE.BufferAttribute(index.array, 1));
    return geometry;
}

// An arrow along z from the origin: `point(length, size)` sets its length and that of the scene.
function forceArrow() {
    const material = new THREE.MeshStandardMaterial({
        color: ARROW_COLOUR, roughness: 0.5, emissive: ARROW_COLOUR, emissiveIntensity: 0.25,
    });
    material.color.convertSRGBToLinear();
    const shaft = new THREE.Mesh(new THREE.CylinderGeometry(1, 1, 1, 20).rotateX(Math.PI / 2), material);
    const head = new THREE.Mesh(new THREE.ConeGeometry(1, 1, 28).rotateX(Math.PI / 2), material);
    const arrow = new THREE.Group();
    arrow.name = "force";
    arrow.add(shaft, head);
    arrow.visible = false;
    arrow.point = (length, size) => {
        const tip = Math.min(0.45 * size, 0.6 * length);
        shaft.scale.set(0.055 * size, 0.055 * size, length - tip);
        shaft.position.z = (length - tip) / 2;
        head.scale.set(0.15 * size, 0.15 * size, tip);
        head.position.z = length - tip / 2;
    };
    return arrow;
}

// What shines on steel and wet tissue: a grey room with bright panels on its ceiling and one wall.
function room(renderer) {
    const scene = new THREE.Scene();
    const box = (colour, size, place, side) => {
        const mesh = new THREE.Mesh(
            new THREE.BoxGeometry(...size), new THREE.MeshBasicMaterial({ color: colour, side: side || THREE.FrontSide }));
        mesh.position.set(...place);
        scene.add(mesh);
        return mesh;
    };
    box(0x5b6468, [20, 12, 20], [0, 0, 0], THREE.BackSide);
    box(0x2a3034, [20, 0.5, 20], [0, -5.8, 0]);
    for (const [x, z] of [[-4, -3], [4, -3], [0, 5]]) {
        box(0xffffff, [3.2, 0.3, 3.2], [x, 5.6, z]).material.color.multiplyScalar(7);
    }
    box(0xffffff, [0.3, 4, 7], [9.6, 1, 0]).material.color.multiplyScalar(3);
    const generator = new THREE.PMREMGenerator(renderer);
    const texture = generator.fromScene(scene, 0.03).texture;
    generator.dispose();
    return texture;
}
