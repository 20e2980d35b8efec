// The readings and controls of the page.
"use strict";

const element = (id) => document.getElementById(id);

const MOST_ON_SMALL = 3; // terms of a score that nobody asked for, on a small screen

let lastReadings = null;

function showReadings(readings) {
    lastReadings = readings;
    element("readings").hidden = false;
    element("time").textContent = `${readings.time.toFixed(2)} s`;
    element("force").textContent = `${readings.newtons.toFixed(2)} N`;
    element("parts").parentElement.hidden = readings.parts.length === 0;
    element("parts").textContent = `${readings.parts.map((part) => part.toFixed(2)).join(" · ")} N`;
    showHands(readings.hands);
    showEnergies(readings.energies);
    element("area").textContent = `${(readings.cut_area * 1e6).toFixed(0)} mm²`;
    element("tetrahedra").textContent = readings.tetrahedra.toLocaleString("en");
}

// The forces on what graspers hold, a row for each.
function showHands(hands) {
    for (const row of document.querySelectorAll("#readings .hand")) row.remove();
    for (const { name, newtons } of hands) {
        const row = document.createElement("div");
        const [term, force] = [document.createElement("dt"), document.createElement("dd")];
        row.className = "hand";
        term.textContent = `force on the grasper ${name}`;
        force.textContent = `${newtons.toFixed(2)} N`;
        row.append(term, force);
        element("area").parentElement.before(row);
    }
}

// The terms of the score: name, figure, and whether it is as was asked for; null: nothing was.
function showScore(rows) {
    element("score").hidden = rows.length === 0;
    element("score").replaceChildren(...rows.map(([name, figure, isMet], i) => {
        const row = document.createElement("div");
        if (isMet === null && i >= MOST_ON_SMALL) row.className = "detail"; // a small screen leaves them out
        const [term, value] = [document.createElement("dt"), document.createElement("dd")];
        term.textContent = name[0].toLowerCase() + name.slice(1);
        value.textContent = isMet === null ? figure : `${figure} ${isMet ? "✓" : "✗"}`;
        if (isMet !== null) value.className = isMet ? "met" : "missed";
        row.append(term, value);
        return row;
    }));
}

// A bar that shows where the work of the blade went. Terms that gave energy back are left out.
function showEnergies(energies) {
    const taken = energies.filter((term) => term.joules > 0);
    element("energies").hidden = taken.length === 0;
    element("energies").replaceChildren(...taken.map((term) => {
        const part = document.createElement("span");
        part.style.flexGrow = term.joules * 1e6;
        part.style.background = term.colour;
        part.title = `${term.label}: ${(term.joules * 1e3).toFixed(2)} mJ`;
        return part;
    }));
}

window.addEventListener("error", (event) => {
    element("status").textContent = `This browser cannot draw the scene: ${event.message}`;
});

// Until the first picture of the tissue is drawn, the page says that it loads.
function showLoaded() {
    element("loading").hidden = sceneView.tissue.size > 0;
}

// A choice of cameras, where there are several.
function offerCameras(cameras) {
    element("view").replaceChildren(...cameras.map((camera, i) => new Option(camera.name, i)));
    element("view").parentElement.hidden = cameras.length < 2;
}

function chooseCamera(number) {
    element("view").value = number;
    sceneView.chooseCamera(number);
}

const sceneView = new SceneView(element("meshcat-pane"), showReadings, offerCameras);
window.viewer = sceneView.viewer; // the name that meshcat's own page uses
const planLine = new PlanLine(sceneView);
sceneView.onScore = showScore;
const coarseness = new Coarseness(sceneView);

function setWireframe(on) {
    element("wireframe").checked = on;
    sceneView.setWireframe(on);
}

function setContacts(on) {
    element("contacts").checked = on;
    sceneView.setContacts(on);
}

element("wireframe").addEventListener("change", (event) => setWireframe(event.target.checked));
element("contacts").addEventListener("change", (event) => setContacts(event.target.checked));
element("home").addEventListener("click", () => chooseCamera(sceneView.chosen));
element("view").addEventListener("change", (event) => chooseCamera(Number(event.target.value)));

// Call back with each key that is a shortcut: one that is pressed alone, and not in a list, whose own
// keys choose from it.
function onShortcut(callback) {
    window.addEventListener("keydown", (event) => {
        const isInList = event.target instanceof Element && event.target.matches("select");
        if (event.ctrlKey || event.altKey || event.metaKey || isInList) return;
        callback(event.key.toLowerCase());
    });
}

onShortcut((key) => {
    if (key === "w") setWireframe(!sceneView.wireframe);
    if (key === "v") setContacts(!sceneView.showsContacts);
    if (key === "h") chooseCamera(sceneView.chosen);
    if (/^[1-9]$/.test(key) && key <= sceneView.cameras.length) chooseCamera(key - 1);
});
