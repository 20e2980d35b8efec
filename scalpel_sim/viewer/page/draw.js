// Draw a cut: lines on the skin, along which the script cuts in the run that follows.
"use strict";

const FINEST_DRAG = 2.5e-3; // between two points of a drag [m]
const LOOKED_UP_EVERY = 1.5e-3; // along a line [m]
const MOST_POINTS = 100, MOST_LINES = 8; // as commands.py has them
const SPEED_OF_CUT = 0.03; // [m/s]
const USUAL_DEPTH = 8e-3, USUAL_SHARE = 0.3; // of the height of the body: those of an incision
const DOT = 0.011; // radius of a point, over the size of the scene
const CURSOR_STEP = 12, FINE_CURSOR_STEP = 2; // of the arrow keys, with Shift the latter [pixels]
const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

class Drawing {
    constructor(view, run, lines) {
        this.view = view;
        this.run = run;
        run.drawing = this;
        this.skin = new SkinAtRest(view);
        this.before = lines; // of this run: `DrawnLine`s, which a further line is added to
        this.points = []; // of the line: places at rest, and normals there
        this.gestures = []; // how many points the line had before each tap and drag
        this.places = []; // of all lines on the skin of the last picture, two for each piece
        this.nBefore = 0; // of them those of lines that are cut in this run
        this.isOff = false; // whether the line leaves the skin
        this.index = null; // of the skin on which the places are
        this.depth = null; // [m]
        this.drag = null; // the pointer that draws
        this.cursor = null; // where the keys point [pixels of the pane]
        this.fingers = new TwoFingers(view.viewer);
        this.bands = [band("halo of the drawing", HALO, 0.9, 1), band("drawing", PLANNED, 1, 2)];
        this.sheet = band("depth of the drawing", PLANNED, 0.35, 3);
        this.bottom = band("bottom of the drawing", PLANNED, 0.9, 3);
        for (const each of [this.sheet, this.bottom]) each.material.depthTest = false; // they are in the body, and show through
        this.dots = new THREE.Group();
        view.viewer.scene.add(...this.bands, this.sheet, this.bottom, this.dots);
        document.querySelector("#looks").before(element("draw"));
        element("meshcat-pane").append(element("draw-cursor"));
        element("draw-mode").addEventListener("click", () => this.toggle());
        element("draw-undo").addEventListener("click", () => this.undo());
        element("draw-clear").addEventListener("click", () => this.clear());
        element("draw-cut").addEventListener("click", () => this.cut());
        element("draw-depth").addEventListener("input", (event) => this.setDepth(event.target.value / 1e3));
        view.viewer.controls.addEventListener("change", () => this.paint());
        this.listen(element("meshcat-pane"), view.viewer.renderer.domElement);
        window.addEventListener("keydown", (event) => this.onKey(event));
        onShortcut((key) => { if (key === "d") this.toggle(); });
        this.showPanel();
    }

    get isOn() {
        return this.run.isDrawing;
    }

    toggle() {
        if (!this.skin.isThere || (!this.isOn && !this.run.leads)) return;
        if (this.depth === null) this.setDepth(this.usualDepth());
        this.run.onInterruption(); // a blade that is led rests
        this.run.isDrawing = !this.isOn;
        document.body.classList.toggle("drawing", this.isOn);
        this.cursor = null;
        this.run.onChange();
        this.showPanel();
    }

    usualDepth() {
        const { min, max } = new THREE.Box3().setFromObject(this.view.tissue.get("skin").mesh);
        element("draw-depth").max = Math.max(1, Math.floor(1e3 * (max.y - min.y)));
        const depth = Math.min(USUAL_DEPTH, USUAL_SHARE * (max.y - min.y));
        return Math.max(Math.round(2e3 * depth) / 2e3, 1e-3);
    }

    setDepth(metres) {
        this.depth = metres;
        element("draw-depth").value = 1e3 * metres;
        this.paint();
        this.showPanel();
    }

    listen(pane, canvas) {
        pane.addEventListener("pointerdown", (event) => {
            if (!this.isOn || event.button !== 0 || event.ctrlKey || event.target !== canvas) return;
            if (event.pointerType === "touch") this.fingers.down(event);
            if (this.fingers.isTurning) {
                if (this.drag !== null) this.undo(); // the first of two fingers drew nothing
                this.drag = null;
                event.stopPropagation();
                return;
            }
            if (!this.addAt(event)) return; // beside the body a drag turns the view
            event.stopPropagation();
            this.drag = event.pointerId;
            pane.setPointerCapture(event.pointerId);
        }, { capture: true });
        pane.addEventListener("pointermove", (event) => {
            if (this.isOn && this.fingers.isTurning) {
                event.stopPropagation();
                this.fingers.move(event);
            } else if (this.drag === event.pointerId) {
                event.stopPropagation();
                this.fingers.move(event);
                this.goOn(event);
            }
        }, { capture: true });
        for (const end of ["pointerup", "pointercancel", "lostpointercapture"]) {
            pane.addEventListener(end, (event) => {
                this.fingers.up(event);
                if (this.drag === event.pointerId) this.drag = null;
            }, { capture: true });
        }
    }

    onKey(event) {
        const { target, key, shiftKey } = event;
        if (!this.isOn || event.altKey || event.metaKey) return;
        if (target instanceof Element && target.matches("select, input")) return;
        const action = event.ctrlKey ? { Enter: () => this.cut() }[key] : {
            Escape: () => this.toggle(), Backspace: () => this.undo(), Enter: () => this.addAtCursor(target),
        }[key] ?? (key in ARROWS ? () => this.moveCursor(ARROWS[key], shiftKey) : undefined);
        if (action === undefined || (key === "Enter" && !event.ctrlKey && target.matches?.("button, a"))) return;
        event.preventDefault();
        action();
    }

    moveCursor([right, down], isFine) {
        const pane = element("meshcat-pane"), step = isFine ? FINE_CURSOR_STEP : CURSOR_STEP;
        const [x, y] = this.cursor ?? [pane.clientWidth / 2, pane.clientHeight / 2];
        this.cursor = [
            Math.min(Math.max(x + step * right, 0), pane.clientWidth),
            Math.min(Math.max(y + step * down, 0), pane.clientHeight),
        ];
        this.showPanel();
    }

    addAtCursor() {
        if (this.cursor === null) return this.moveCursor([0, 0], true);
        const { left, top } = element("meshcat-pane").getBoundingClientRect();
        if (!this.addAt({ clientX: left + this.cursor[0], clientY: top + this.cursor[1] })) this.say("There is no skin under the ring.");
    }

    // The place of the skin under a pointer; null where there is none.
    placeAt({ clientX, clientY }) {
        const eye = new THREE.Vector3(), way = this.view.sightThrough(clientX, clientY, eye);
        return this.skin.isThere ? this.skin.seenAlong(eye, way) : null;
    }

    // Begin a tap or a drag; returns whether it is on the skin.
    addAt(event) {
        const place = this.placeAt(event);
        if (place === null) return false;
        this.gestures.push(this.points.length);
        this.add(place, 1e-4);
        return true;
    }

    goOn(event) {
        const place = this.placeAt(event);
        if (place !== null) this.add(place, FINEST_DRAG);
    }

    add(place, least) {
        const rest = this.skin.rest(place), last = this.points[this.points.length - 1];
        const isNear = last !== undefined && distance(rest, last.rest) < least;
        if (isNear || this.points.length >= MOST_POINTS) return;
        this.points.push({ rest, normal: this.skin.normal(place) });
        this.lookUp();
    }

    undo() {
        if (this.gestures.length === 0) return;
        this.points.length = this.gestures.pop();
        this.lookUp();
    }

    clear() {
        if (this.points.length === 0) this.before = [];
        this.points = [];
        this.gestures = [];
        this.lookUp();
    }

    // Against the depth: the mean of the normals of the skin at its points.
    get edge() {
        const sum = new THREE.Vector3();
        for (const { normal } of this.points) sum.add(new THREE.Vector3(...normal));
        return sum.normalize().toArray().map((part) => Number(part.toFixed(4)));
    }

    get line() {
        const points = this.points.map(({ rest }) => rest.map((x) => Number(x.toFixed(6))));
        return { points, edge: this.edge, depth: this.depth, speed: SPEED_OF_CUT };
    }

    get lines() {
        return this.points.length < 2 ? this.before : [...this.before, this.line];
    }

    get canCut() {
        return this.points.length >= 2 && !this.isOff && this.run.leads && this.lines.length <= MOST_LINES;
    }

    cut() {
        if (!this.canCut) return;
        this.run.ask({ type: "cut", lines: this.lines });
        this.toggle();
    }

    // A picture shows the body: it has moved, and a cut has other triangles.
    show() {
        if (!this.skin.isThere) return;
        const { array } = this.skin.geometry.index;
        if (this.index === null || !areSame(this.index, array)) this.lookUp();
        else this.paint();
        this.showPanel();
    }

    // Look up all lines on the skin of the last picture.
    lookUp() {
        if (!this.skin.isThere) return;
        this.index = this.skin.geometry.index.array;
        const before = planLine.isThere ? [] : this.before; // as the plan they are drawn already
        this.places = before.flatMap(({ points, edge }) => this.onSkin(points, edge).places);
        const { places, isOff } = this.onSkin(this.points.map(({ rest }) => rest), this.edge);
        this.nBefore = this.places.length;
        this.places.push(...places);
        this.isOff = isOff;
        this.marks = this.points.map(({ rest }) => this.skin.at(rest, this.edge.map((x) => -x)));
        this.paint();
        this.showPanel();
    }

    // Pieces of a straight line between points, seen along the edge, as places of the skin.
    onSkin(points, edge) {
        const into = edge.map((x) => -x), places = [];
        let isOff = false;
        for (let i = 0; i + 1 < points.length; i += 1) {
            const n = Math.max(1, Math.ceil(distance(points[i], points[i + 1]) / LOOKED_UP_EVERY));
            let last = null;
            for (let k = 0; k <= n; k += 1) {
                const near = points[i].map((x, axis) => x + k / n * (points[i + 1][axis] - x));
                const place = this.skin.at(near, into);
                isOff = isOff || place === null;
                if (last !== null && place !== null) places.push(last, place);
                last = place;
            }
        }
        return { places, isOff };
    }

    // Draw the lines where they are now, as seen from where the eye is now.
    paint() {
        if (!this.skin.isThere || this.index === null) return;
        const { scene, camera } = this.view.viewer;
        const toScene = scene.matrixWorld.clone().invert().multiply(this.skin.matrix);
        const inScene = (place) => new THREE.Vector3(...this.skin.now(place)).applyMatrix4(toScene);
        const eye = scene.worldToLocal(camera.getWorldPosition(new THREE.Vector3()));
        const ends = this.places.map(inScene);
        this.bands.forEach((each, i) => each.draw(ribbon(ends, eye, this.view.extent, i === 0 ? 2.4 : 1.3)));
        const down = new THREE.Vector3(...this.edge).multiplyScalar(-(this.depth ?? 0));
        const [origin, end] = [new THREE.Vector3(), down].map((each) => each.clone().applyMatrix4(toScene));
        const top = ends.slice(this.nBefore), way = end.sub(origin);
        this.sheet.draw(hanging(top, way));
        this.bottom.draw(ribbon(top.map((each) => each.clone().add(way)), eye, this.view.extent, 0.6));
        const marks = (this.marks ?? []).filter((place) => place !== null && this.points.length < 20).map(inScene);
        while (this.dots.children.length > marks.length) this.dots.remove(this.dots.children[0]);
        while (this.dots.children.length < marks.length) this.dots.add(dot());
        marks.forEach((at, i) => {
            this.dots.children[i].position.copy(at);
            this.dots.children[i].scale.setScalar(DOT * this.view.extent);
        });
        this.view.viewer.set_dirty();
    }

    get length() {
        return this.points.slice(1).reduce((sum, { rest }, i) => sum + distance(rest, this.points[i].rest), 0);
    }

    hint() {
        const n = this.points.length;
        const after = this.before.length === 0 ? "" : ` It follows ${this.before.length === 1 ? "the cut" : `the ${this.before.length} cuts`} of this run.`;
        if (!this.run.leads) return "Another tab controls the run.";
        if (n === 0) return `Tap two or more points on the skin, or drag along it. Beside the body a drag turns the view.${after}`;
        if (this.isOff) return "The line leaves the skin: take back the last point.";
        if (n === 1) return "Tap where it goes from there.";
        if (this.lines.length > MOST_LINES) return `A run has ${MOST_LINES} cuts at most.`;
        return `${(1e3 * this.length).toFixed(0)} mm long, ${(1e3 * this.depth).toFixed(1)} mm deep. The script cuts it in a new run.${after}`;
    }

    say(text) {
        if (element("draw-hint").textContent !== text) element("draw-hint").textContent = text;
    }

    showPanel() {
        element("draw-mode").setAttribute("aria-pressed", String(this.isOn));
        element("draw-mode").disabled = !this.run.leads;
        element("draw").hidden = !this.isOn;
        element("draw-cursor").hidden = !this.isOn || this.cursor === null;
        if (this.cursor !== null) [element("draw-cursor").style.left, element("draw-cursor").style.top] = this.cursor.map((x) => `${x}px`);
        element("draw-undo").disabled = this.points.length === 0;
        element("draw-clear").disabled = this.points.length === 0 && this.before.length === 0;
        element("draw-cut").disabled = !this.canCut;
        const depth = `${(1e3 * (this.depth ?? 0)).toFixed(1)} mm`;
        element("draw-depth-value").textContent = depth;
        element("draw-depth").setAttribute("aria-valuetext", depth.replace("mm", "millimetres"));
        this.say(this.hint());
    }
}

const distance = (a, b) => Math.hypot(...a.map((x, axis) => x - b[axis]));

function dot() {
    const ball = (color, radius) => new THREE.Mesh(new THREE.SphereGeometry(radius, 16, 12), new THREE.MeshBasicMaterial({ color }));
    const found = ball(PLANNED, 0.72), rim = ball(HALO, 1);
    rim.material.side = THREE.BackSide;
    return found.add(rim);
}
