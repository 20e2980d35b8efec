// What the next run is to be: its scene, material and blade, and who leads it. See messages.Choices.
"use strict";

const TOUGHEST = 4; // decades of the slider, from 1 J/m² up

// The slider is logarithmic: toughness spans decades from gelatin to skin.
const toughnessAt = (position) => Number((10 ** (TOUGHEST * position / 100)).toPrecision(2));
const positionOf = (toughness) => 100 * Math.log10(Math.max(toughness, 1)) / TOUGHEST;

class NextRun {
    constructor(run, choices) {
        this.run = run;
        this.choices = choices;
        this.hasToughness = this.hasThickness = false; // whether the person has chosen one
        const nameOf = (scene) => scene || choices.first;
        const optionsOf = (names) => names.map((name) => new Option(nameOf(name), name));
        const tasks = document.createElement("optgroup");
        tasks.label = "Tasks";
        tasks.append(...optionsOf(choices.tasks));
        element("scene").replaceChildren(...optionsOf(choices.scenes), ...(choices.tasks.length ? [tasks] : []));
        element("material").replaceChildren(...["", ...choices.materials].map(
            (name) => new Option(name || "as in the scene", name)));
        element("scene").value = choices.scene;
        element("material").value = choices.material;
        element("by-hand").checked = choices.is_led;
        element("scene").addEventListener("change", () => this.forget());
        element("material").addEventListener("change", () => this.forget());
        element("toughness").addEventListener("input", () => { this.hasToughness = true; this.show(); });
        element("thickness").addEventListener("input", () => { this.hasThickness = true; this.show(); });
        document.querySelector("#choices form").addEventListener("submit", (event) => {
            event.preventDefault();
            this.begin(element("by-hand").checked);
        });
        element("swap").textContent = choices.is_led ? "watch the script" : "lead it yourself";
        element("swap").addEventListener("click", () => this.begin(!choices.is_led));
        element("swap").hidden = false;
        this.forget();
    }

    get isAsNow() {
        const { scene, material } = this.choices;
        return element("scene").value === scene && element("material").value === material;
    }

    // With another scene or material go its own toughness and blade.
    forget() {
        this.hasToughness = this.hasThickness = false;
        element("toughness").value = positionOf(this.choices.toughness);
        element("thickness").value = this.choices.blade_thickness * 1e3;
        this.show();
    }

    show() {
        const text = (value, unit, isChosen) =>
            isChosen || this.isAsNow ? `${value} ${unit}` : "its own";
        const toughness = this.hasToughness ? toughnessAt(element("toughness").value) : this.choices.toughness;
        const toughnessText = text(Number(toughness.toPrecision(3)), "J/m²", this.hasToughness);
        const thicknessText = text(Number(element("thickness").value), "mm", this.hasThickness);
        element("toughness-value").textContent = toughnessText;
        element("toughness").setAttribute("aria-valuetext", toughnessText);
        element("thickness-value").textContent = thicknessText;
        element("thickness").setAttribute("aria-valuetext", thicknessText);
    }

    begin(isLed) {
        this.run.ask({
            type: "begin",
            scene: element("scene").value,
            material: element("material").value || null,
            toughness: this.hasToughness ? toughnessAt(element("toughness").value) : null,
            blade_thickness: this.hasThickness ? element("thickness").value / 1e3 : null,
            is_led: isLed,
        });
    }

    showControls() {
        for (const id of ["begin", "swap"]) element(id).disabled = !this.run.leads;
    }
}
