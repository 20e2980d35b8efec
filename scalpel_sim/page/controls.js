// What is on the page beside the picture.
"use strict";

const element = (id) => document.getElementById(id);

function showReadings(readings) {
    element("readings").hidden = false;
    element("time").textContent = `${readings.time.toFixed(2)} s`;
    element("force").textContent = `${readings.newtons.toFixed(2)} N`;
    element("area").textContent = `${(readings.cut_area * 1e6).toFixed(0)} mm²`;
    element("tetrahedra").textContent = readings.tetrahedra.toLocaleString("en");
}

window.addEventListener("error", (event) => {
    element("status").textContent = `this browser cannot draw the picture: ${event.message}`;
});

const picture = new Picture(element("meshcat-pane"), showReadings);
window.viewer = picture.viewer; // as on meshcat's own page

function setWireframe(on) {
    element("wireframe").checked = on;
    picture.setWireframe(on);
}

element("wireframe").addEventListener("change", (event) => setWireframe(event.target.checked));
element("home").addEventListener("click", () => picture.setCamera(picture.home));
window.addEventListener("keydown", (event) => {
    if (event.key === "w") setWireframe(!picture.wireframe);
    if (event.key === "h") picture.setCamera(picture.home);
});
