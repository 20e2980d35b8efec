// How the tissue is drawn: faces, grid or the cut alone, as the paper shows it.
"use strict";

const SHOWN_BY_KEY = { f: "faces", g: "grid", c: "cut" };

function setShown(shown) {
    element("shown").value = shown;
    sceneView.setShown(shown);
}

element("shown").addEventListener("change", (event) => setShown(event.target.value));
onShortcut((key) => { if (key in SHOWN_BY_KEY) setShown(SHOWN_BY_KEY[key]); });
