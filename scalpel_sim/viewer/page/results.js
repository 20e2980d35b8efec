// What a run has given, when it has ended: its figures, its files, and what to try next.
"use strict";

const WORTH_A_TRY = ["organ", "retract", "excise", "incision"]; // scenes, of which the page offers three

class Results {
    constructor(run) {
        this.run = run;
        this.shown = null;
        const address = `/replay${run.query}`;
        // On a small screen it would hide the tissue.
        element("results").open = !window.matchMedia("(max-width: 640px), (max-height: 480px)").matches;
        element("open-replay").href = element("save-replay").href = address;
        element("open-report").href = element("save-report").href = `/report${run.query}`;
    }

    // `results` is a `RunResults`: figures, folder, paths of replay and report; null while the run goes on.
    show(results) {
        element("results").hidden = results === null;
        for (const button of element("try-next").querySelectorAll("button")) button.disabled = !this.run.leads;
        if (results === null || this.shown !== null) return;
        const [figures, folder, replay, report] = this.shown = results;
        element("figures").replaceChildren(...figures.flatMap(([label, figure]) => {
            const [term, value] = [document.createElement("dt"), document.createElement("dd")];
            term.textContent = label;
            value.textContent = figure;
            return [term, value];
        }));
        element("folder").textContent = folder;
        element("replays").hidden = replay === "";
        element("save-replay").download = pictureName().replace(/-[\d.]+s\.png$|\.png$/, "-replay.html");
        element("reports").hidden = report === "";
        element("save-report").download = element("save-replay").download.replace(/replay\.html$/, "report.html");
        this.offerNext();
    }

    offerNext() {
        const { next } = this.run;
        element("try-next").hidden = next === null;
        if (next === null) return;
        const { scene, first, scenes, is_led: isLed } = next.choices;
        const others = WORTH_A_TRY.filter((name) => scenes.includes(name) && name !== (scene || first));
        const begin = (text, name, leads) => {
            const button = document.createElement("button");
            button.textContent = text;
            button.addEventListener("click", () => this.run.ask({ type: "begin", scene: name, is_led: leads }));
            return button;
        };
        element("offers").replaceChildren(
            begin(isLed ? "watch the script" : "lead the blade yourself", scene, !isLed),
            ...others.slice(0, 3).map((name) => begin(name, name, isLed)),
        );
    }
}
