"""The energy account over time, as one picture."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scalpel_sim.output.force_plot import DOTS_PER_INCH, MAGNITUDE, legend, simplify
from scalpel_sim.recording.energy_terms import TERMS, Term
from scalpel_sim.recording.recording import Recording

_MJ_PER_J = 1e3
PERCENT = 100.0

SMALLEST_VISIBLE = 0.003
"""Share of the largest term below which a term is left out of the picture: its line would be too
thin to be seen. The table has it."""

OPACITY = 0.85
"""Opacity of the stacked terms: the grid is seen through them."""

_MARGINS = {"left": 0.14, "right": 0.985, "bottom": 0.08, "top": 0.86, "hspace": 0.12}
"""Fixed margins, for the reason given in `scalpel_sim.output.force_plot`."""


def plot_energies(recording: Recording, title: str, path: Path) -> None:
    """Write a PNG: the terms of the account on top of each other, and the residual."""
    time = recording.column("time_s")
    work = sum(recording.column(f"work_of_{what}_j") for what in ("blade", "loads", "supports"))
    figure = Figure(figsize=(8.0, 5.8))
    above, below = figure.subplots(
        2, 1, sharex=True, height_ratios=(3.2, 1.0), gridspec_kw=_MARGINS
    )
    figure.suptitle(title, x=0.01, y=0.985, ha="left", fontsize=12, fontweight="bold")
    for sign in (1.0, -1.0):
        _stack(above, time, recording, sign)
    above.plot(time, _MJ_PER_J * work, color=MAGNITUDE, lw=1.6, label="work put in")
    above.axhline(0.0, color=MAGNITUDE, lw=0.6)
    above.set_ylabel("energy [mJ]")
    legend(above, 4)

    most = float(np.abs(work).max(initial=0.0))
    residual = recording.column("residual_j") / most if most > 0.0 else np.zeros_like(time)
    below.plot(time, PERCENT * residual, color=MAGNITUDE, lw=1.2)
    below.set_ylabel("residual\n[% of the work]")
    below.set_xlabel("time [s]")
    for axes in (above, below):
        simplify(axes)
    figure.align_ylabels()
    FigureCanvasAgg(figure).print_figure(path, dpi=DOTS_PER_INCH, format="png")


def _stack(axes: Axes, time: np.ndarray, recording: Recording, sign: float) -> None:
    """Stack the terms of one sign: from zero upwards for 1, downwards for -1."""
    base = np.zeros_like(time)
    for term in _visible(recording):
        height = np.clip(sign * _energy(recording, term), 0.0, None)
        if height.any():
            is_first = sign > 0.0 or not (_energy(recording, term) > 0.0).any()
            label = term.label if is_first else None
            low, high = sign * _MJ_PER_J * base, sign * _MJ_PER_J * (base + height)
            axes.fill_between(
                time, low, high, color=term.colour, lw=0.0, alpha=OPACITY, label=label
            )
            base = base + height


def _visible(recording: Recording) -> list[Term]:
    """Return the terms that are large enough to be seen."""
    sizes = [float(np.abs(_energy(recording, term)).max(initial=0.0)) for term in TERMS]
    return [
        term
        for term, size in zip(TERMS, sizes, strict=True)
        if size > SMALLEST_VISIBLE * max(sizes)
    ]


def _energy(recording: Recording, term: Term) -> np.ndarray:
    """Return a term over time [J]."""
    return recording.column(f"{term.name}_j")
