"""Draws the plots of a validation as PNG files, without pyplot, which would look for a display."""

from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scalpel_sim.validate.findings import Plot

# Okabe and Ito's palette, whose colours remain distinct in colour blindness.
_CURVE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#222222")
_BAND_COLOURS = ("#999999", "#e69f00", "#56b4e9")
_DOTS_PER_INCH = 100
_MOST_MARKERS = 12
"""Curves of no more points than this are drawn as points."""
_MOST_INSIDE = 5
"""A legend of more entries than this stands beside the plot."""


def draw_plot(plot: Plot, path: Path) -> None:
    """Write a plot as a PNG file."""
    figure = Figure(figsize=(8.0, 4.2), layout="constrained")
    axes = figure.subplots()
    axes.set_title(plot.title, loc="left", fontsize=11, fontweight="bold")
    for band, colour in zip(plot.bands, _BAND_COLOURS, strict=False):
        axes.axhspan(band.low, band.high, color=colour, alpha=0.25, lw=0.0, label=band.label)
    colour = _CURVE_COLOURS[-1]
    n_drawn = 0
    for curve in plot.curves:
        if curve.is_theory:
            axes.plot(curve.x, curve.y, color=colour, lw=1.0, ls="--", label=curve.label or None)
            continue
        colour = _CURVE_COLOURS[n_drawn % len(_CURVE_COLOURS)]
        n_drawn += 1
        as_points = len(curve.x) <= _MOST_MARKERS
        shape = {"marker": "o", "ls": "", "ms": 5} if as_points else {"lw": 1.4}
        axes.plot(curve.x, curve.y, color=colour, label=curve.label, **shape)
    axes.set_xlabel(plot.x)
    axes.set_ylabel(plot.y)
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    if len(axes.get_legend_handles_labels()[0]) > _MOST_INSIDE:
        figure.legend(frameon=False, fontsize=8, loc="outside right upper")
    else:
        axes.legend(frameon=False, fontsize=8, loc="best")
    FigureCanvasAgg(figure).print_figure(path, dpi=_DOTS_PER_INCH, format="png")
