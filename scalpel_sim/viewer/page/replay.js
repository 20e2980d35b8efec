// Plays the frames of a run in simulated time, again and again.
"use strict";

const PAUSE_AT_END = 0.8; // pause before the replay starts again [s]

class Player {
    constructor(frames, times) {
        this.frames = frames;
        this.times = times;
        this.first = times[0];
        this.length = times[times.length - 1] - times[0];
        this.speed = 1;
        this.now = 0; // [s] since the first frame
        this.shown = -1;
        this.isPlaying = false;
        const scrubber = element("scrubber");
        scrubber.max = this.length;
        scrubber.step = "any";
        scrubber.addEventListener("input", () => { this.pause(); this.seek(Number(scrubber.value)); });
        element("play").addEventListener("click", () => this.toggle());
        element("speed").addEventListener("change", (event) => { this.speed = Number(event.target.value); });
        window.addEventListener("keydown", (event) => {
            if (event.key === " ") { event.preventDefault(); this.toggle(); }
            if (event.key === "ArrowRight") this.stepFrames(1);
            if (event.key === "ArrowLeft") this.stepFrames(-1);
        });
        this.seek(0);
    }

    play() {
        this.isPlaying = true;
        element("play").textContent = "❚❚ pause";
        let before = performance.now();
        const advance = (now) => {
            if (!this.isPlaying) return;
            const next = this.now + this.speed * (now - before) / 1000;
            before = now;
            this.seek(next > this.length + PAUSE_AT_END * this.speed ? 0 : next);
            requestAnimationFrame(advance);
        };
        requestAnimationFrame(advance);
    }

    pause() {
        this.isPlaying = false;
        element("play").textContent = "▶ play";
    }

    toggle() {
        if (this.isPlaying) this.pause();
        else this.play();
    }

    stepFrames(n) {
        this.pause();
        const frame = Math.min(Math.max(this.shown + n, 0), this.frames.length - 1);
        this.seek(this.times[frame] - this.first);
    }

    seek(now) {
        this.now = now;
        element("scrubber").value = now;
        let frame = 0;
        while (frame + 1 < this.times.length && this.times[frame + 1] - this.first <= now + 1e-9) frame += 1;
        if (frame === this.shown) return;
        this.shown = frame;
        coarseness.onChange();
        viewer.handle_command(this.frames[frame]);
        chart.mark(frame);
        afterDrawing((duration) => coarseness.note(duration));
    }
}

// A chart of the force over time, with a mark at the frame that is shown.
class Chart {
    constructor(frames) {
        this.forces = frames.map((frame) => {
            const readings = frame.commands.find((command) => command.type === "set_readings");
            return readings ? Math.hypot(...readings.force) : 0;
        });
        this.canvas = document.createElement("canvas");
        this.canvas.id = "chart";
        this.canvas.width = 2 * 204;
        this.canvas.height = 2 * 54;
        element("readings").append(this.canvas);
    }

    mark(frame) {
        const { width, height } = this.canvas;
        const context = this.canvas.getContext("2d");
        const peak = Math.max(...this.forces, 1e-9);
        const x = (i) => 4 + (width - 8) * i / Math.max(this.forces.length - 1, 1);
        const y = (force) => height - 6 - (height - 14) * force / peak;
        context.clearRect(0, 0, width, height);
        context.lineWidth = 3;
        context.lineJoin = "round";
        for (const [colour, end] of [["#c9b6b2", this.forces.length], ["#a33b30", frame + 1]]) {
            context.strokeStyle = colour;
            context.beginPath();
            this.forces.slice(0, end).forEach((force, i) => context.lineTo(x(i), y(force)));
            context.stroke();
        }
        context.fillStyle = "#a33b30";
        context.beginPath();
        context.arc(x(frame), y(this.forces[frame]), 5, 0, 2 * Math.PI);
        context.fill();
    }
}

// Decodes a packet with meshcat's decoder, without applying it.
function decode(bytes) {
    const { handle_command: apply } = viewer;
    let decoded;
    viewer.handle_command = (command) => { decoded = command; };
    viewer.handle_command_bytearray(bytes);
    viewer.handle_command = apply;
    return decoded;
}

// Makes the geometries of a frame once, so that they are there when the replay starts again.
function keepGeometries(frame) {
    for (const command of frame.commands) {
        if (command.type !== "set_object") continue;
        command.geometry = geometryOf(command.object.geometries[0].data);
        command.geometry.isKept = true;
        command.object.geometries = [];
    }
    return frame;
}

async function unpack(script) {
    const packed = await fetch(`data:application/octet-stream;base64,${script.textContent.trim()}`);
    const body = packed.body.pipeThrough(new DecompressionStream("gzip"));
    return decode(new Uint8Array(await new Response(body).arrayBuffer()));
}

let chart, player;

async function start() {
    const [opening, ...packed] = document.querySelectorAll("script.packet");
    viewer.handle_command(await unpack(opening));
    setWireframe(sceneView.wireframe);
    const frames = [];
    for (const script of packed) {
        frames.push(keepGeometries(await unpack(script)));
        script.remove();
        if (frames.length > 1) continue;
        viewer.handle_command(frames[0]);
        showLoaded();
    }
    for (const frame of frames) { // the scale is that of the whole run
        sceneView.colours.setTops(frame.commands.find(({ type }) => type === "set_scales").tops);
    }
    sceneView.colours.keepsRange = true;
    chart = new Chart(frames);
    player = new Player(frames, packed.map((script) => Number(script.dataset.time)));
    player.play();
}

start().catch((error) => {
    element("loading").hidden = true;
    element("status").textContent = `This replay cannot be shown: ${error}`; });
