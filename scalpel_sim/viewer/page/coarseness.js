// How coarsely a picture is drawn while the blade is led. Without a graphics card it is the drawing that
// takes the time from hand to picture: shadows and blurred panels are left out first, then pixels. At
// rest all is drawn.
"use strict";

const LONGEST_DRAWING_LED = 40; // [ms]: where it takes longer, the next coarser picture is drawn
const N_DRAWINGS = 4; // whose median it is
const LEVELS = [
    { shadows: true, pixels: 1 },
    { shadows: false, pixels: 1 },
    { shadows: false, pixels: 0.6 },
    { shadows: false, pixels: 0.4 },
];
const REST_BEFORE_FINE = 400; // [ms]

class Coarseness {
    constructor(view) {
        this.view = view;
        this.isLed = false;
        this.level = 0; // while it is led
        this.times = [];
        this.timer = null;
    }

    // Draw for a hand that leads, or for one that rests.
    setLed(isLed) {
        clearTimeout(this.timer);
        if (isLed) this.apply(true);
        else this.timer = setTimeout(() => this.apply(false), REST_BEFORE_FINE);
    }

    apply(isLed) {
        if (isLed === this.isLed) return;
        this.isLed = isLed;
        this.times = [];
        this.draw(isLed ? this.level : 0);
    }

    draw(level) {
        this.view.setDrawing(LEVELS[level]);
        document.body.classList.toggle("coarse", level > 0);
    }

    // A picture took so long to draw [ms].
    note(duration) {
        if (!this.isLed || this.level === LEVELS.length - 1) return;
        this.times.push(duration);
        if (this.times.length < N_DRAWINGS) return;
        const median = this.times.sort((a, b) => a - b)[N_DRAWINGS >> 1];
        this.times = [];
        if (median <= LONGEST_DRAWING_LED) return;
        this.level += 1;
        this.draw(this.level);
    }
}
