// The hand of the page: it says to the run how the chosen instrument is to move, and shows how late that is.
"use strict";

const ALIVE_EVERY = 100; // how often an engaged hand says that the page is there [ms]
const SHORTEST_STEP = 200; // how long a step holds the blade at least [ms]
const LONGEST_STEP = 10000; // and at most, where no picture shows that it moves
const N_LAGS_SHOWN = 30; // of which the median is shown
const MOST_LAGS = 2000; // that are kept

class Hand {
    constructor(view, run) {
        this.view = view;
        this.viewer = view.viewer;
        this.run = run;
        this.isClutchOpen = false;
        this.isEngaged = false;
        this.hasMoved = false;
        this.hasEnded = false;
        this.pointer = null; // where it points, while it leads
        this.holders = new Map(); // what holds the blade, and since when it only finishes a step [ms]
        this.instruments = new Instruments(this);
        this.tip = null; // of the chosen instrument in the last picture [m], world frame
        this.isAtRest = true; // whether it was there in the picture before
        this.movedAt = 0; // when a picture last showed that it moves [ms]
        this.unshown = []; // stamps of inputs that no picture has shown yet [ms]
        this.lags = [];
        this.aim = new Aim(view);
        this.section = new Section(view);
        this.reach = new Reach(this);
        this.fingers = new TwoFingers(view.viewer);
        view.onHand = (state) => this.show(state);
        run.onChange = () => this.onRunChange();
        run.onInterruption = () => this.forget();
        setInterval(() => this.sayAlive(), ALIVE_EVERY);
        window.addEventListener("blur", () => this.letGoOfAll());
        document.addEventListener("visibilitychange", () => document.hidden && this.letGoOfAll());
        element("clutch").addEventListener("click", () => this.toggleClutch());
        document.querySelector("footer").before(element("hint"));
        const pane = element("meshcat-pane");
        pane.tabIndex = 0;
        pane.setAttribute("role", "application");
        pane.setAttribute("aria-label", "The tissue and the blade");
        pane.setAttribute("aria-describedby", "hint");
        this.viewer.controls.mouseButtons.RIGHT = THREE.MOUSE.ROTATE;
        listenToPointer(pane, this.viewer.renderer.domElement, this);
        listenToKeys(this);
        listenToGamepads(this);
        this.showControls();
    }

    // Whether fingers are what this device has.
    get isTouched() {
        return window.matchMedia("(pointer: coarse)").matches;
    }

    // Whether the input of this page leads the blade.
    get isClosed() {
        const isFree = !this.isClutchOpen && !this.hasEnded && !this.run.isDrawing;
        return this.run.leads && this.tip !== null && isFree;
    }

    // Release, and do not wait for what was requested: the run continues from elsewhere.
    forget() {
        this.letGoOfAll();
        this.unshown = [];
    }

    // Who controls the run, or the connection to it, has changed.
    onRunChange() {
        if (!this.run.leads) this.letGoOfAll();
        this.showControls();
    }

    // After a silence the run has released; then it engages again.
    sayAlive() {
        this.letGoOfSteps();
        if (this.isEngaged) this.run.say({ type: "still there" });
    }

    // Hold the blade until `letGo`; or, for a step, until a picture shows that it is done.
    hold(holder, isStep = false) {
        if (!this.isClosed) return;
        this.holders.set(holder, isStep ? performance.now() : Infinity);
        if (!this.isEngaged) this.run.say({ type: "engage" });
        this.isEngaged = true;
        coarseness.isLed = true;
    }

    letGo(holder) {
        this.holders.delete(holder);
        if (!this.isEngaged || this.holders.size > 0) return;
        this.run.say({ type: "release" });
        this.isEngaged = false;
        coarseness.isLed = false;
    }

    letGoOfSteps() {
        for (const [holder, since] of [...this.holders]) {
            const passed = performance.now() - since;
            const isDone = this.unshown.length === 0 && this.isAtRest && passed > SHORTEST_STEP;
            const isStuck = Math.min(passed, performance.now() - this.movedAt) > LONGEST_STEP;
            if (isDone || isStuck) this.letGo(holder);
        }
    }

    // The pointer has let go: the blade goes on to where it pointed last.
    finish(holder) {
        this.aim.letGo();
        this.pointer = null;
        if (this.holders.has(holder)) this.holders.set(holder, performance.now());
    }

    letGoOfAll() {
        this.aim.letGo();
        this.pointer = null;
        for (const holder of [...this.holders.keys()]) this.letGo(holder);
    }

    toggleClutch() {
        this.letGoOfAll();
        this.isClutchOpen = !this.isClutchOpen;
        this.showControls();
    }

    // Move by [right, up, away] in metres. `stamp` is when the person did it [ms].
    move(by, stamp) {
        this.lead({ type: "move", by: this.inWorld(by), stamp });
    }

    // Turn by a rotation vector about the axes [right, up, away] of the view [rad].
    turn(by, stamp) {
        this.lead({ type: "turn", by: this.inWorld(by), stamp });
    }

    // Move by a vector of three.js [m] as one step.
    step(holder, by, stamp) {
        this.hold(holder, true);
        this.lead({ type: "move", by: turnedBack(by), stamp });
    }

    // Lead what is chosen to a place of the window, in its plane.
    aimAt(clientX, clientY, stamp) {
        if (!this.isEngaged || !this.isClosed) return;
        if (this.aim.held === null) this.aim.take();
        this.pointer = [clientX, clientY];
        for (const to of this.aim.at(clientX, clientY)) this.lead({ type: "aim", to, stamp });
    }

    // The depth or the plane is another now.
    aimAgain(stamp) {
        if (this.pointer !== null) this.aimAt(...this.pointer, stamp);
    }

    lead(message) {
        if (!this.isEngaged || !this.isClosed) return;
        this.run.say(message);
        this.unshown.push(message.stamp);
        if (!this.hasMoved) {
            this.hasMoved = true;
            this.showControls();
        }
    }

    // Up is z in the scene and y in three.js: see SceneView.setCamera.
    inWorld([right, up, away]) {
        const { camera } = this.viewer;
        camera.updateMatrixWorld();
        const vector = new THREE.Vector3(right, up, -away).transformDirection(camera.matrixWorld);
        vector.multiplyScalar(Math.hypot(right, up, away));
        return [vector.x, -vector.z, vector.y];
    }

    // A picture says how the hand is in it.
    show(state) {
        const { tip, engaged, ended, stamp, instruments, chosen, closed } = state;
        this.instruments.show(instruments, chosen, closed);
        this.isAtRest = this.tip !== null && tip.every((x, axis) => x === this.tip[axis]);
        this.tip = tip;
        if (!this.isAtRest) this.movedAt = performance.now();
        if (ended && !this.hasEnded) this.letGoOfAll();
        this.hasEnded = ended;
        document.body.classList.toggle("engaged", engaged);
        element("take-over").disabled = engaged;
        if (stamp !== null) this.noteLags(stamp);
        this.aim.show(state);
        this.reach.show(state);
        this.showControls();
        this.section.show(state, this.aim.mark.visible && closed === null);
    }

    // Each input up to the stamp is in the picture that is drawn next.
    noteLags(stamp) {
        const shown = this.unshown.filter((each) => each <= stamp);
        if (shown.length === 0 || !this.unshown.includes(stamp)) return; // of another page
        this.unshown = this.unshown.filter((each) => each > stamp);
        afterDrawing(() => {
            this.lags.push(...shown.map((each) => performance.now() - each));
            this.lags.splice(0, this.lags.length - MOST_LAGS);
            const last = this.lags.slice(-N_LAGS_SHOWN).sort((a, b) => a - b);
            element("lag").textContent = `${last[last.length >> 1].toFixed(0)} ms from hand to picture`;
        });
    }

    showControls() {
        const { controls } = this.viewer;
        // With Ctrl the controls exchange the two.
        controls.mouseButtons.LEFT = this.isClosed ? THREE.MOUSE.PAN : THREE.MOUSE.ROTATE;
        element("clutch").setAttribute("aria-pressed", String(!this.isClutchOpen));
        element("clutch").textContent = `lead the ${this.instruments.noun}`;
        this.aim.mark.visible = this.isClosed;
        this.section.line.visible &&= this.isClosed;
        this.reach.enable(this.isClosed);
        this.instruments.enable(this.run.leads && !this.hasEnded);
        element("clutch").disabled = !this.run.leads || this.hasEnded;
        element("hint").textContent = this.hint();
        element("hint").hidden = element("hint").textContent === "";
    }

    hint() {
        if (this.hasEnded) return "The run has ended.";
        const { noun } = this.instruments;
        if (this.run.socket === null || this.tip === null) return "";
        if (!this.run.leads) return "Another tab leads the blade.";
        if (this.run.isDrawing) return "";
        if (this.isClutchOpen) return `Drags turn the view. Space: lead the ${noun} again.`;
        if (this.run.isPaused) return "Time stands still: press \"continue\", or K";
        const isBlade = this.instruments.isClosed === null;
        if (isBlade && this.section.isMissed) return "The blade passes next to the body: move it \"sideways\"";
        if (this.hasMoved) return "";
        const [press, turn] = this.isTouched ? ["Put a finger", ". Two fingers turn the view"] : ["Press", ""];
        return isBlade
            ? `${press} on the body and drag across it: the ${noun} goes there, along the white line${turn}`
            : `${press} on the picture and drag: the ${noun} goes there, in the plane of its jaws${turn}`;
    }
}
