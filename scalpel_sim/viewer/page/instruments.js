// The choice of what the page leads, the blade or a grasper, and the jaws of that.
"use strict";

class Instruments {
    constructor(hand) {
        this.hand = hand;
        this.names = [];
        this.chosen = 0;
        this.isClosed = null; // null: it has no jaws
        element("instrument").addEventListener("change", (event) => {
            this.choose(Number(event.target.value));
            event.target.blur(); // so that the arrow keys lead
        });
        element("jaws").addEventListener("click", () => this.toggleJaws());
    }

    // What the page calls the chosen one. The first is the blade.
    get noun() {
        return this.chosen === 0 ? "blade" : `${this.names[this.chosen]} grasper`;
    }

    // A picture says which there are, and how the chosen one is.
    show(names, chosen, isClosed) {
        if (String(names) !== String(this.names)) {
            this.names = names;
            element("instrument").replaceChildren(...names.map((name, i) => new Option(name, i)));
            element("instruments").hidden = names.length < 2;
        }
        if (chosen !== this.chosen) element("instrument").value = chosen;
        this.chosen = chosen;
        this.isClosed = isClosed;
        element("jaws").hidden = isClosed === null;
        element("jaws").textContent = isClosed ? "open the jaws" : "close the jaws";
    }

    enable(isEnabled) {
        for (const id of ["instrument", "jaws"]) element(id).disabled = !isEnabled;
    }

    // Release first: nothing jumps.
    choose(number) {
        this.hand.letGoOfAll();
        this.hand.run.say({ type: "choose", instrument: number });
    }

    chooseNext() {
        if (this.names.length > 1) this.choose((this.chosen + 1) % this.names.length);
    }

    toggleJaws() {
        if (this.isClosed !== null) this.hand.run.say({ type: "jaws", closed: !this.isClosed });
    }
}
