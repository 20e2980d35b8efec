// A page that follows a run. It says when it has drawn a packet, so that the server sends the next.
"use strict";

const RETRY_AFTER = 2000; // [ms]

function follow() {
    const socket = new WebSocket(`ws://${location.host}/frames`);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => { element("status").textContent = "live"; };
    socket.onmessage = (message) => {
        viewer.handle_command_bytearray(new Uint8Array(message.data));
        element("wireframe").checked = picture.wireframe;
        socket.send("drawn");
    };
    socket.onclose = () => {
        element("status").textContent = "the run has ended; waiting for the next";
        setTimeout(awaitNext, RETRY_AFTER);
    };
}

function awaitNext() {
    fetch("/").then(() => location.reload(), () => setTimeout(awaitNext, RETRY_AFTER));
}

follow();
