// How coarsely a picture is drawn while it changes. Without a graphics card it is the drawing that takes
// the time from hand to picture: shadows, smooth skin and blurred panels are left out first, then relief and gloss,
// then pixels. At rest all is drawn.
"use strict";

// What each level leaves out, and what its picture costs by software, as a share of the first.
const LEVELS = [
    { shadows: true, plain: false, pixels: 1, smooth: true, cost: 1 },
    { shadows: false, plain: false, pixels: 1, smooth: false, cost: 0.8 },
    { shadows: false, plain: true, pixels: 1, smooth: false, cost: 0.25 },
    { shadows: false, plain: true, pixels: 0.7, smooth: false, cost: 0.13 },
    { shadows: false, plain: true, pixels: 0.5, smooth: false, cost: 0.07 },
    { shadows: false, plain: true, pixels: 0.35, smooth: false, cost: 0.04 },
    { shadows: false, plain: true, pixels: 0.25, smooth: false, cost: 0.025 },
];
const FIRST_BY_SOFTWARE = 4; // level at the start where no card draws
const LONGEST_LED = 40; // [ms]: where a picture takes longer, and a hand leads, the next is coarser
const LONGEST_WATCHED = 80; // and where nobody leads
const N_DRAWINGS = 4; // whose median it is
const N_QUICK = 12; // that must have been quick before a finer level is tried
const N_UNCOUNTED = 2; // after a change: they make shaders
const REST_BEFORE_FINE = 400; // [ms]
const SOON = 250; // [ms]: where no picture comes so long, a mark that moved is drawn without one

// The level of pictures that change, from the times that pictures took.
class Levels {
    constructor(level) {
        this.level = level;
        this.begin();
    }

    begin() {
        this.times = [];
        this.nUncounted = N_UNCOUNTED;
    }

    // A picture took so long to draw [ms], where it may take `longest`.
    note(duration, longest) {
        if (this.nUncounted > 0) {
            this.nUncounted -= 1;
            return;
        }
        this.times.push(duration);
        const last = this.level === LEVELS.length - 1;
        if (this.times.length >= N_DRAWINGS && !last && median(this.times.slice(-N_DRAWINGS)) > longest) {
            this.go(1, median(this.times.slice(-N_DRAWINGS)), longest);
        } else if (this.times.length >= N_QUICK) {
            const time = median(this.times);
            this.times = [];
            if (this.level > 0 && this.expected(time, -1) <= longest) this.go(-1);
        }
    }

    // What a picture is expected to take some levels further [ms].
    expected(time, further) {
        return time * LEVELS[this.level + further].cost / LEVELS[this.level].cost;
    }

    // Coarser as far as is expected to suffice, or finer by one: then what is expected is too long a
    // time rather than too short, as some of it is the same at all levels.
    go(step, time, longest) {
        let further = step;
        while (step > 0 && this.level + further < LEVELS.length - 1 && this.expected(time, further) > longest) {
            further += 1;
        }
        this.level += further;
        this.begin();
    }
}

function median(values) {
    return [...values].sort((a, b) => a - b)[values.length >> 1];
}

class Coarseness {
    constructor(view) {
        this.view = view;
        this.levels = new Levels(view.isSoftware ? FIRST_BY_SOFTWARE : 0);
        this.drawn = 0; // the level that is drawn
        this.isLed = false;
        this.timer = null;
        this.marksTimer = null; // while marks wait for a picture
        view.viewer.controls.addEventListener("change", () => this.onChange());
    }

    // The picture changes: draw it for one that moves, until it rests.
    onChange() {
        clearTimeout(this.marksTimer);
        this.marksTimer = null;
        this.draw(this.levels.level);
        clearTimeout(this.timer);
        this.timer = setTimeout(() => this.draw(0), REST_BEFORE_FINE);
    }

    // Marks of a pointer have moved, of which there are several between two pictures: by software the next
    // picture shows them, as drawing each would make it late.
    showMarks() {
        const { viewer, isSoftware } = this.view;
        if (!isSoftware) return viewer.set_dirty();
        this.marksTimer ??= setTimeout(() => {
            this.marksTimer = null;
            viewer.set_dirty();
        }, SOON);
    }

    draw(level) {
        if (level === this.drawn) return;
        this.drawn = level;
        this.view.setDrawing(LEVELS[level]);
        document.body.classList.toggle("coarse", level > 0);
    }

    // A picture of one that moves took so long to draw [ms].
    note(duration) {
        this.levels.note(duration, this.isLed ? LONGEST_LED : LONGEST_WATCHED);
    }
}
