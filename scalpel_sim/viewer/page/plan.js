// The plan of a cut, drawn on the tissue: what is open of it in another colour. It moves with the material.
"use strict";

const PLANNED = 0x4b2fb0, HALO = 0xffffff; // the ink of a surgeon's pen, on tissue of any colour
const OPEN = 0x3ddc84; // light beside the ink, for eyes that do not tell colours apart
const WIDEST_GAP = 3; // between two places of a line, over the distance of the first two: farther on is another line

class PlanLine {
    constructor(view) {
        this.view = view;
        this.places = []; // of the line now, scene
        this.isOpen = []; // whether the cut is open there
        this.bands = {
            halo: band("halo of the plan", HALO, 0.9, 1), planned: band("plan", PLANNED, 1, 2), open: band("plan that is open", OPEN, 1, 2),
        };
        view.viewer.scene.add(...Object.values(this.bands));
        view.onPlan = (command) => this.show(command);
        view.viewer.controls.addEventListener("change", () => this.paint());
    }

    get isThere() {
        return this.places.length > 1;
    }

    // A picture says where it is: places [m], world frame, and whether each is open, one after the other.
    show({ places, open }) {
        const at = places.array;
        this.places = Array.from(open.array, (_, i) => new THREE.Vector3(at[3 * i], at[3 * i + 1], at[3 * i + 2]));
        this.isOpen = Array.from(open.array, (each) => each > 0);
        this.paint();
    }

    paint() {
        if (!this.isThere) return;
        const { scene, camera } = this.view.viewer;
        const eye = scene.worldToLocal(camera.getWorldPosition(new THREE.Vector3()));
        const { places, isOpen } = this, longest = WIDEST_GAP * places[0].distanceTo(places[1]);
        const pieces = { planned: [], open: [] };
        for (let i = 0; i + 1 < places.length; i += 1) {
            if (places[i].distanceTo(places[i + 1]) > longest) continue;
            const middle = places[i].clone().lerp(places[i + 1], 0.5);
            pieces[isOpen[i] ? "open" : "planned"].push(places[i], middle);
            pieces[isOpen[i + 1] ? "open" : "planned"].push(middle, places[i + 1]);
        }
        const { extent } = this.view;
        this.bands.halo.draw(ribbon([...pieces.planned, ...pieces.open], eye, extent, 2.4));
        for (const [name, ends] of Object.entries(pieces)) this.bands[name].draw(ribbon(ends, eye, extent, 1.3));
        this.view.viewer.set_dirty();
    }
}
