// A page that follows a run. It tells the server when it has drawn a packet, and then gets the next.
"use strict";

const RETRY_AFTER = 2000; // time between attempts to reach the next run [ms]

function follow() {
    const socket = new WebSocket(`ws://${location.host}/frames`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { element("status").textContent = "live"; };
    socket.onmessage = (message) => {
        viewer.handle_command_bytearray(new Uint8Array(message.data));
        element("wireframe").checked = sceneView.wireframe;
        socket.send("drawn");
    };
    socket.onclose = () => {
        element("status").textContent = "the run has ended; waiting for the next run";
        setTimeout(waitForNextRun, RETRY_AFTER);
    };
}

function waitForNextRun() {
    fetch("/").then(() => location.reload(), () => setTimeout(waitForNextRun, RETRY_AFTER));
}

follow();
