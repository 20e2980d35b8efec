// A page that follows a run. It tells the server when it has drawn a packet, and then gets the next.
"use strict";

const RETRY_AFTER = 2000; // time between attempts to reach the next run [ms]
const LONGEST_DRAWING = 500; // [ms]: a tab that is hidden draws nothing

// Call back once what was changed is on the screen: asked for another picture before, a page that draws
// slowly would decode many that it never shows.
function afterDrawing(callback) {
    let isDone = false;
    const once = () => {
        if (!isDone) callback();
        isDone = true;
    };
    requestAnimationFrame(() => setTimeout(once));
    setTimeout(once, LONGEST_DRAWING);
}

// Where the page leads the blade: see hand.js.
const hand = typeof Hand === "undefined" ? null : new Hand(sceneView);

let run = null; // the socket, where there is one

onQuantity = (quantity) => {
    if (run === null || run.readyState !== WebSocket.OPEN) return;
    run.send(JSON.stringify({ type: "colour", quantity: quantity || null }));
};

function follow() {
    const socket = new WebSocket(`ws://${location.host}/frames${hand ? hand.query : ""}`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
        element("status").textContent = "live";
        run = socket;
        if (element("quantity").value) setQuantity(element("quantity").value); // as before a reload
        if (hand) hand.connect(socket);
    };
    socket.onmessage = (message) => {
        if (typeof message.data === "string") {
            hand.onLeading(JSON.parse(message.data));
            return;
        }
        viewer.handle_command_bytearray(new Uint8Array(message.data));
        element("wireframe").checked = sceneView.wireframe;
        afterDrawing(() => { if (socket.readyState === WebSocket.OPEN) socket.send("drawn"); });
    };
    socket.onclose = () => {
        if (hand) hand.disconnect();
        element("status").textContent = "the run has ended; waiting for the next run";
        setTimeout(waitForNextRun, RETRY_AFTER);
    };
}

function waitForNextRun() {
    fetch("/").then(() => location.reload(), () => setTimeout(waitForNextRun, RETRY_AFTER));
}

follow();
