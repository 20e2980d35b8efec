// A page that follows a run. It reports to the server when it has drawn a packet, and then gets the next.
"use strict";

const RETRY_AFTER = 2000; // time between attempts to reach the next run [ms]

// Where the page controls the run, and leads its blade: see run.js and hand.js.
const run = typeof Run === "undefined" ? null : new Run(sceneView);
const hand = typeof Hand === "undefined" ? null : new Hand(sceneView, run);

const forcePlot = new ForcePlot();

let openSocket = null;

onQuantity = (quantity) => {
    if (openSocket === null || openSocket.readyState !== WebSocket.OPEN) return;
    openSocket.send(JSON.stringify({ type: "colour", quantity: quantity || null }));
};

if (typeof NextRun !== "undefined") {
    run.next = new NextRun(run, CHOICES);
    run.showControls();
}
const drawing = typeof Drawing === "undefined" ? null : new Drawing(sceneView, run, CHOICES.lines);

function follow() {
    const socket = new WebSocket(`ws://${location.host}/frames${run ? run.query : ""}`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
        element("status").textContent = "live";
        openSocket = socket;
        if (element("quantity").value) setQuantity(element("quantity").value); // as before a reload
        if (run) run.connect(socket);
    };
    socket.onmessage = (message) => {
        if (typeof message.data === "string") {
            const said = JSON.parse(message.data);
            if (said.reload) location.reload();
            else if (said.forces) forcePlot.add(said.forces);
            else run.onLeading(said);
            return;
        }
        coarseness.onChange();
        viewer.handle_command_bytearray(new Uint8Array(message.data));
        if (drawing) drawing.show();
        element("wireframe").checked = sceneView.wireframe;
        afterDrawing((duration) => {
            coarseness.note(duration);
            showLoaded();
            if (socket.readyState === WebSocket.OPEN) socket.send("drawn");
        });
    };
    socket.onclose = () => {
        if (run) run.disconnect();
        element("status").textContent = "the run has ended; waiting for the next run";
        setTimeout(waitForNextRun, RETRY_AFTER);
    };
}

function waitForNextRun() {
    fetch("/").then(() => location.reload(), () => setTimeout(waitForNextRun, RETRY_AFTER));
}

follow();
