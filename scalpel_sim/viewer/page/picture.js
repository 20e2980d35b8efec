// Saves what the page shows as a PNG: the scene, its heading, the readings, and the scale or the legend of colours.
"use strict";

const MARGIN = 24, LINE = 22; // [CSS pixels]
const TEXT_COLOUR = "#223037", LABEL_COLOUR = "#4d5f67";
const BOX_COLOUR = "rgba(255, 255, 255, 0.85)";

const DOWNLOAD_TIME = 10000; // after which the browser has read the picture [ms]

// Named after the page and the simulated time, in characters that every file system takes.
function pictureName() {
    const scene = document.title.toLowerCase().replace(/[^a-z0-9]+/g, "-").replace(/^-+|-+$/g, "");
    const time = lastReadings === null ? "" : `-${lastReadings.time.toFixed(3)}s`;
    return `${scene || "scene"}${time}.png`;
}

function drawPicture() {
    const { renderer, scene, camera } = viewer;
    const canvas = document.createElement("canvas");
    canvas.width = renderer.domElement.width;
    canvas.height = renderer.domElement.height;
    const context = canvas.getContext("2d");
    const scale = canvas.width / renderer.domElement.clientWidth;
    const width = canvas.width / scale, height = canvas.height / scale;
    context.scale(scale, scale);
    renderer.render(scene, camera); // the canvas forgets its pixels once they are on the screen
    context.drawImage(renderer.domElement, 0, 0, width, height);
    drawTexts(context, MARGIN, MARGIN, [[document.title, ""]]);
    const rows = shownReadings();
    if (rows.length > 0) drawTexts(context, MARGIN, height - 2 * MARGIN - LINE * rows.length, rows);
    if (sceneView.colours.isThere) drawScale(context, width, height);
    else if (!element("legend").hidden) drawLegend(context, width, height);
    return canvas;
}

// The scale of colours, in the lower right corner.
function drawScale(context, width, height) {
    const { title, ticks } = scaleTexts(sceneView.colours);
    const length = 220, x = width - MARGIN - length - 24, y = height - MARGIN - 2 * LINE - 32;
    context.fillStyle = BOX_COLOUR;
    context.fillRect(x, y, length + 24, 2 * LINE + 32);
    const shade = context.createLinearGradient(x + 12, 0, x + 12 + length, 0);
    gradient().forEach((colour, i, all) => shade.addColorStop(i / (all.length - 1), colour));
    context.fillStyle = shade;
    context.fillRect(x + 12, y + 6 + LINE, length, 14);
    context.fillStyle = TEXT_COLOUR;
    context.fillText(title, x + 12, y + 6 + LINE / 2);
    ticks.forEach((tick, i) => {
        const part = i / (ticks.length - 1); // the first begins at the left end, the last ends at the right
        const at = x + 12 + part * (length - context.measureText(tick).width);
        context.fillText(tick, at, y + 24 + 1.5 * LINE);
    });
}

// The colours of labels, in the same corner.
function drawLegend(context, width, height) {
    const widest = Math.max(...legend.map(({ title }) => context.measureText(title).width));
    const boxWidth = widest + 54, boxHeight = LINE * legend.length + 12;
    const x = width - MARGIN - boxWidth, y = height - MARGIN - boxHeight;
    context.fillStyle = BOX_COLOUR;
    context.fillRect(x, y, boxWidth, boxHeight);
    legend.forEach(({ title, skin, inside }, i) => {
        const middle = y + 6 + LINE * (i + 0.5);
        [skin, inside].forEach((colour, side) => {
            context.fillStyle = colour;
            context.fillRect(x + 12 + 10 * side, middle - 7, 10, 14);
        });
        context.fillStyle = TEXT_COLOUR;
        context.fillText(title, x + 42, middle);
    });
}

// Labels and values, as the page shows them.
function shownReadings() {
    if (element("readings").hidden) return [];
    return [...document.querySelectorAll("#readings dl > div:not([hidden])")]
        .filter((row) => row.querySelector("dt"))
        .map((row) => [row.querySelector("dt").textContent, row.querySelector("dd").textContent]);
}

function drawTexts(context, x, y, rows) {
    const font = `14px ${getComputedStyle(document.body).fontFamily}`;
    context.font = font;
    const widest = (column) => Math.max(...rows.map((row) => context.measureText(row[column]).width));
    const labels = widest(0), values = widest(1);
    const gap = values > 0 ? 24 : 0;
    context.fillStyle = BOX_COLOUR;
    context.fillRect(x, y, labels + gap + values + 24, LINE * rows.length + 12);
    context.textBaseline = "middle";
    rows.forEach(([label, value], i) => {
        const middle = y + 6 + LINE * (i + 0.5);
        context.fillStyle = value ? LABEL_COLOUR : TEXT_COLOUR;
        context.fillText(label, x + 12, middle);
        context.fillStyle = TEXT_COLOUR;
        context.fillText(value, x + 12 + labels + gap, middle);
    });
}

function savePicture() {
    drawPicture().toBlob((blob) => {
        const link = document.createElement("a");
        link.href = URL.createObjectURL(blob);
        link.download = pictureName();
        link.click();
        setTimeout(() => URL.revokeObjectURL(link.href), DOWNLOAD_TIME);
    }, "image/png");
}

element("save-picture").addEventListener("click", savePicture);
onShortcut((key) => { if (key === "p") savePicture(); });
