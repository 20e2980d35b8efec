// A plot of the last seconds of the forces on the blade and on the graspers, in the live page.
"use strict";

const SECONDS_SHOWN = 5; // of simulated time
const LOWEST_PEAK = 0.1; // [N] at the upper side at least: else noise would fill the plot
const PIXELS = 2; // of the canvas, along one of the page
const LABEL = 12; // height of the letters [pixels of the page]
const LINES = ["--blade-line", "--grasper-line", "--other-line"]; // colours of the style, for light and dark

class ForcePlot {
    constructor() {
        this.rows = []; // [s, N on the blade, N on each grasper]
        this.canvas = document.createElement("canvas");
        this.canvas.id = "chart";
        this.canvas.setAttribute("role", "img");
        element("readings").append(this.canvas);
        const drawAgain = () => this.rows.length > 0 && this.draw();
        new ResizeObserver(drawAgain).observe(this.canvas);
        matchMedia("(prefers-color-scheme: dark)").addEventListener("change", drawAgain);
    }

    // All rows since the last picture. After an undo the time is an earlier one, and what came later did
    // not happen.
    add(rows) {
        for (const row of rows) {
            while (this.rows.length > 0 && this.rows[this.rows.length - 1][0] >= row[0]) this.rows.pop();
            this.rows.push(row);
        }
        const first = this.rows[this.rows.length - 1][0] - SECONDS_SHOWN;
        this.rows.splice(0, this.rows.findIndex(([time]) => time > first));
        this.draw();
    }

    // The lowest and the highest force at each pixel of the page across. By software a line through each of
    // thousands of rows took longer than the scene.
    columns(x, force) {
        const found = [];
        for (const row of this.rows) {
            if (force >= row.length) continue;
            const at = PIXELS * Math.round(x(row[0]) / PIXELS), value = row[force], last = found[found.length - 1];
            if (last === undefined || last[0] !== at) found.push([at, value, value]);
            else [last[1], last[2]] = [Math.min(last[1], value), Math.max(last[2], value)];
        }
        return found;
    }

    draw() {
        const { clientWidth, clientHeight } = this.canvas;
        if (clientWidth === 0) return; // a low window has no room for it
        const width = PIXELS * clientWidth, height = PIXELS * clientHeight;
        if (this.canvas.width !== width) this.canvas.width = width;
        if (this.canvas.height !== height) this.canvas.height = height;
        const context = this.canvas.getContext("2d", { willReadFrequently: true });
        const now = this.rows[this.rows.length - 1][0];
        const peak = this.rows.reduce((most, [, ...forces]) => Math.max(most, ...forces), LOWEST_PEAK);
        const x = (time) => width - 6 - (width - 12) * (now - time) / SECONDS_SHOWN;
        const y = (force) => height - 6 - (height - PIXELS * LABEL - 10) * force / peak;
        context.clearRect(0, 0, width, height);
        context.lineWidth = 3;
        context.lineJoin = "round";
        const style = getComputedStyle(this.canvas);
        for (const [i, colour] of LINES.entries()) {
            context.strokeStyle = style.getPropertyValue(colour);
            context.beginPath();
            for (const [at, low, high] of this.columns(x, i + 1)) {
                context.lineTo(at, y(low));
                if (high !== low) context.lineTo(at, y(high));
            }
            context.stroke();
        }
        context.fillStyle = style.getPropertyValue("--soft");
        context.font = `${PIXELS * LABEL}px system-ui, sans-serif`;
        context.fillText(`${peak.toFixed(2)} N, last ${SECONDS_SHOWN} s`, 0, PIXELS * LABEL);
        this.canvas.setAttribute("aria-label",
            `forces over the last ${SECONDS_SHOWN} seconds, at most ${peak.toFixed(2)} newtons`);
    }
}
