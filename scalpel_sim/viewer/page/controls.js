// What is on the page beside the picture.
"use strict";

const element = (id) => document.getElementById(id);

function showReadings(readings) {
    element("readings").hidden = false;
    element("time").textContent = `${readings.time.toFixed(2)} s`;
    element("force").textContent = `${readings.newtons.toFixed(2)} N`;
    element("parts").parentElement.hidden = readings.parts.length === 0;
    element("parts").textContent = `${readings.parts.map((part) => part.toFixed(2)).join(" · ")} N`;
    showAccount(readings.account);
    element("area").textContent = `${(readings.cut_area * 1e6).toFixed(0)} mm²`;
    element("tetrahedra").textContent = readings.tetrahedra.toLocaleString("en");
}

// A bar of where the work of the blade went: what was taken, not what was given back.
function showAccount(account) {
    const taken = account.filter((term) => term.joules > 0);
    element("account").hidden = taken.length === 0;
    element("account").replaceChildren(...taken.map((term) => {
        const part = document.createElement("span");
        part.style.flexGrow = term.joules * 1e6;
        part.style.background = term.colour;
        part.title = `${term.label}: ${(term.joules * 1e3).toFixed(2)} mJ`;
        return part;
    }));
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
function setContacts(on) {
    element("contacts").checked = on;
    picture.setContacts(on);
}

element("contacts").addEventListener("change", (event) => setContacts(event.target.checked));
element("home").addEventListener("click", () => picture.setCamera(picture.home));
window.addEventListener("keydown", (event) => {
    if (event.key === "w") setWireframe(!picture.wireframe);
    if (event.key === "c") setContacts(!picture.showsContacts);
    if (event.key === "h") picture.setCamera(picture.home);
});
