"""Force and cut area over time, as one picture.

Without pyplot: no display is looked for, and nothing is kept between two pictures.
"""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scalpel_sim.recording import Recording

# Okabe and Ito's palette: told apart by those who see fewer colours too.
COMPONENTS = (("x", "#d55e00"), ("y", "#009e73"), ("z", "#0072b2"))
MAGNITUDE = "#222222"
AREA = "#aa3377"
DOTS_PER_INCH = 150
MARGINS = {"left": 0.1, "right": 0.985, "bottom": 0.085, "top": 0.89, "hspace": 0.07}
"""Fixed: to let matplotlib find them by itself would draw everything twice."""
MM2_PER_M2 = 1e6


def plot_forces(recording: Recording, title: str, path: Path) -> None:
    """Write a PNG: the force on the blade above, the area that it has cut below."""
    time = recording.column("time_s")
    force = recording.vector("force")

    figure = Figure(figsize=(8.0, 5.4))
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(2.2, 1.0), gridspec_kw=MARGINS)
    figure.suptitle(title, x=0.01, y=0.985, ha="left", fontsize=12, fontweight="bold")

    above.plot(time, np.linalg.norm(force, axis=1), color=MAGNITUDE, lw=1.6, label="magnitude")
    for i, (axis, colour) in enumerate(COMPONENTS):
        above.plot(time, force[:, i], color=colour, lw=1.0, label=f"${axis}$")
    above.set_ylabel("force on the blade [N]")
    above.legend(ncols=4, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), fontsize=9)

    area = recording.column("cut_area_m2") * MM2_PER_M2
    below.fill_between(time, area, color=AREA, alpha=0.15, lw=0.0)
    below.plot(time, area, color=AREA, lw=1.6)
    below.set_ylabel("cut area [mm²]")
    below.set_ylim(bottom=0.0)
    below.set_xlabel("time [s]")

    for axes in (above, below):
        axes.spines[["top", "right"]].set_visible(False)
        axes.grid(color="0.9", lw=0.6)
        axes.set_axisbelow(True)
        axes.margins(x=0.0)
    figure.align_ylabels()
    FigureCanvasAgg(figure).print_figure(path, dpi=DOTS_PER_INCH)
