// The run of the page: it stands still, goes slowly and goes back as the person requests. The first tab
// controls it; another takes over.
"use strict";

const SLOWER = 0.95; // factor of real time, of what was requested, below which the page says so
const PARTED = 0.005; // distance of stylus and blade from which the page tells it [m]

const NO_STATE = {
    paused: false, rate: 1, real_time: 1, can_go_back: false, strokes: 0, ended: false, notice: "",
    stylus_distance: 0, results: null,
};

class Run {
    constructor(view) {
        this.query = `?token=${encodeURIComponent(TOKEN)}`;
        this.socket = null;
        this.leads = false;
        this.state = null; // in the last picture: see RunState
        this.next = null; // what the next run is to be
        this.drawing = null;
        this.isDrawing = false; // whether a press draws a line: see draw.js
        this.onChange = () => {};
        view.onRun = (state) => this.show(state);
        element("pause").addEventListener("click", () => this.togglePause());
        element("step").addEventListener("click", () => this.step());
        element("rate").addEventListener("change", (event) => this.setRate(Number(event.target.value)));
        element("undo").addEventListener("click", () => this.undo());
        this.results = new Results(this);
        element("reset").addEventListener("click", () => this.ask({ type: "reset" }));
        element("end").addEventListener("click", () => this.ask({ type: "end" }));
        document.querySelector("footer").before(element("notice"));
        element("panels").before(element("results"));
        element("take-over").addEventListener("click", () => this.say({ type: "lead" }));
        window.addEventListener("keydown", (event) => this.onKey(event));
        this.showControls();
    }

    get isPaused() {
        return this.state !== null && this.state.paused;
    }

    connect(socket) {
        this.socket = socket;
        this.onChange();
        this.showControls();
    }

    disconnect() {
        this.socket = null;
        this.onLeading({ leads: false });
    }

    say(message) {
        if (this.socket === null || this.socket.readyState !== WebSocket.OPEN) return;
        this.socket.send(JSON.stringify(message));
    }

    // What does not go together with a blade that is held.
    ask(message) {
        this.onInterruption();
        this.say(message);
    }

    onInterruption() {}

    togglePause() {
        this.ask({ type: this.isPaused ? "resume" : "pause" });
    }

    step() {
        this.say({ type: this.isPaused ? "step" : "pause" });
    }

    undo() {
        this.ask({ type: "undo" });
    }

    setRate(rate) {
        this.say({ type: "slow motion", rate });
    }

    onKey(event) {
        const { target, key } = event;
        if (event.altKey || event.metaKey || (target instanceof Element && target.matches("select, input"))) return;
        const action = event.ctrlKey
            ? { z: () => this.undo() }[key]
            : { k: () => this.togglePause(), ".": () => this.step() }[key];
        if (action === undefined || !this.leads) return;
        event.preventDefault();
        action();
    }

    // The server says who controls the run, each time that changes.
    onLeading({ leads }) {
        this.leads = leads;
        this.onChange();
        this.showControls();
    }

    // A picture says how the run is in it.
    show(state) {
        this.state = state;
        this.showControls();
    }

    showControls() {
        const {
            paused, rate, real_time: realTime, can_go_back: canGoBack, strokes, ended, notice, results,
            stylus_distance: distance,
        } = this.state || NO_STATE;
        for (const id of ["pause", "step", "rate", "end"]) element(id).disabled = !this.leads || ended;
        element("pause").textContent = paused ? "continue" : "pause";
        element("rate").value = String(rate);
        element("undo").disabled = !this.leads || ended || strokes === 0;
        const mayRepeat = ended && results !== null && this.next !== null;
        element("reset").textContent = ended ? "again" : "reset";
        element("reset").title = ended ? "the same run from its start" : "back to the start";
        element("reset").disabled = !this.leads || (ended ? !mayRepeat : !canGoBack);
        element("take-over").hidden = this.leads || this.socket === null;
        element("pace").textContent = ended ? "ended" : paused ? "paused" : paceOf(realTime, rate) + aheadOf(distance);
        element("notice").textContent = notice;
        element("notice").hidden = notice === "";
        if (this.next) this.next.showControls();
        if (this.drawing) this.drawing.showPanel();
        this.results.show(results);
    }
}

// How far the stylus of a device and the blade have parted, where that is more than the blade takes to follow.
function aheadOf(distance) {
    return distance < PARTED ? "" : `, stylus ${(1e3 * distance).toFixed(0)} mm from the blade`;
}

function paceOf(realTime, rate) {
    if (realTime >= SLOWER * rate) return rate === 1 ? "real time" : "slow motion";
    return `${realTime.toPrecision(1)} of real time: this machine is too slow`;
}
