"""The plots of a validation as PNGs. Without pyplot: no display is looked for."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scalpel_sim.validate.findings import Plot

# Okabe and Ito's palette: told apart by those who see fewer colours too.
COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#222222")
BANDS = ("#999999", "#e69f00", "#56b4e9")
_DOTS_PER_INCH = 100
MARKED = 12
"""Curves of no more points than this are drawn as points."""
_BESIDE = 5
"""A legend of more entries than this stands beside the plot."""


def draw(plot: Plot, path: Path) -> None:
    """Write a plot as a PNG."""
    figure = Figure(figsize=(8.0, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.set_title(plot.title, loc="left", fontsize=11, fontweight="bold")
    for band, colour in zip(plot.bands, BANDS, strict=False):
        axes.axhspan(band.low, band.high, color=colour, alpha=0.25, lw=0.0, label=band.label)
    colour = COLOURS[-1]
    n_drawn = 0
    for curve in plot.curves:
        if curve.is_theory:
            axes.plot(curve.x, curve.y, color=colour, lw=1.0, ls="--", label=curve.label or None)
            continue
        colour = COLOURS[n_drawn % len(COLOURS)]
        n_drawn += 1
        shape = {"marker": "o", "ls": "", "ms": 5} if len(curve.x) <= MARKED else {"lw": 1.4}
        axes.plot(curve.x, curve.y, color=colour, label=curve.label, **shape)
    axes.set_xlabel(plot.x)
    axes.set_ylabel(plot.y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    if len(axes.get_legend_handles_labels()[0]) > _BESIDE:
        figure.legend(frameon=False, fontsize=8, loc="outside right upper")
    else:
        axes.legend(frameon=False, fontsize=8, loc="best")
    FigureCanvasAgg(figure).print_figure(path, dpi=_DOTS_PER_INCH, format="png")
