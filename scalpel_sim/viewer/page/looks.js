// How the tissue is drawn: faces, grid or the cut alone, as the paper shows it; and coloured by what.
"use strict";

const SHOWN_BY_KEY = { f: "faces", g: "grid", c: "cut" };

let onQuantity = () => {}; // a live page reports it to the run, which computes what is looked at

function setShown(shown) {
    element("shown").value = shown;
    sceneView.setShown(shown);
}

function setQuantity(quantity) {
    element("quantity").value = quantity;
    onQuantity(quantity);
    sceneView.setQuantity(quantity);
}

function nextQuantity() {
    const choices = ["", ...Object.keys(QUANTITIES)];
    setQuantity(choices[(choices.indexOf(element("quantity").value) + 1) % choices.length]);
}

// Texts of the scale at its lower end, middle and upper end, and its title.
function scaleTexts(colours) {
    const { title, unit, factor } = QUANTITIES[colours.quantity];
    const text = (value) => Number((factor * value).toPrecision(3)).toString();
    const ticks = ["0", text(colours.range / 2), `≥ ${text(colours.range)}`];
    return { title: unit ? `${title} [${unit}]` : title, ticks };
}

function showScale(colours) {
    hideLegend(colours);
    element("scale").hidden = colours.quantity === "";
    if (colours.quantity === "") return;
    const { title, ticks } = scaleTexts(colours);
    element("scale-title").textContent = colours.isThere ? title : `${title}: not in this picture yet`;
    element("scale-bar").hidden = element("scale-ticks").hidden = !colours.isThere;
    element("scale-ticks").replaceChildren(...ticks.map((tick) => {
        const part = document.createElement("span");
        part.textContent = tick;
        return part;
    }));
}

// The colours of labels, outside and inside.
let legend = [];

function showLegend(entries) {
    legend = entries;
    element("legend").replaceChildren(...entries.map(({ title, skin, inside }) => {
        const [item, colour] = [document.createElement("li"), document.createElement("span")];
        colour.style.background = `linear-gradient(to right, ${skin} 50%, ${inside} 50%)`;
        item.append(colour, title);
        return item;
    }));
    hideLegend(sceneView.colours);
}

// Values that are shown win over labels.
function hideLegend(colours) {
    element("legend").hidden = legend.length === 0 || colours.isThere;
}

// The colours of the scale in equal steps, as CSS has them.
function gradient() {
    return Array.from({ length: 17 }, (_, i) =>
        `rgb(${viridis(i / 16).map((part) => Math.round(255 * part)).join(" ")})`);
}

sceneView.onScale = showScale;
sceneView.onLegend = showLegend;
element("scale-bar").style.background = `linear-gradient(to right, ${gradient().join(", ")})`;

// A list that was opened by a pointer gives the keys back once something is chosen. By keys one may continue.
function chooseIn(list, choose) {
    let isByPointer = false;
    list.addEventListener("pointerdown", () => { isByPointer = true; });
    list.addEventListener("keydown", () => { isByPointer = false; });
    list.addEventListener("change", () => {
        choose(list.value);
        if (isByPointer) list.blur();
    });
}

// On a small screen the choices would hide the tissue.
if (window.matchMedia("(max-width: 960px), (max-height: 480px)").matches) element("display").open = false;
chooseIn(element("shown"), setShown);
chooseIn(element("quantity"), setQuantity);
onShortcut((key) => {
    if (key in SHOWN_BY_KEY) setShown(SHOWN_BY_KEY[key]);
    if (key === "q") nextQuantity();
});
