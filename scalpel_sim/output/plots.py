"""Forces, cut area and the energy account over time, as pictures.

Without pyplot: no display is needed, and nothing is kept between two pictures.
"""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scalpel_sim.recording.recording import TERMS, Recording, Term

# Okabe and Ito's palette, which colour-blind readers can distinguish too.
COMPONENTS = (("x", "#d55e00"), ("y", "#009e73"), ("z", "#0072b2"))

PARTS = (
    ("edge_force", "edge", "#cc79a7"),
    ("pressing_force", "faces, pressing", "#56b4e9"),
    ("friction_force", "faces, friction", "#e69f00"),
)

HELD = ("#222222", "#009e73", "#0072b2", "#d55e00")
"""Colours of the forces on attachments; more than these are not drawn."""

MAGNITUDE = "#222222"

_AREA = "#aa3377"

LIMITED = "#d55e00"

HAND_COLOURS = ("#882255", "#117733", "#999933")
"""Colours of graspers, in turn: Paul Tol's muted palette."""

DOTS_PER_INCH = 150

_FORCE_MARGINS = {"left": 0.1, "right": 0.985, "bottom": 0.065, "top": 0.91, "hspace": 0.16}
"""Fixed margins: matplotlib finds its own only by drawing everything twice."""

_ENERGY_MARGINS = {"left": 0.14, "right": 0.985, "bottom": 0.08, "top": 0.86, "hspace": 0.12}
"""Fixed margins of the energy plot."""

_MM2_PER_M2 = 1e6

_SAME = 1e-9
"""Relative difference between the forces of tissue and arm that is only rounding."""

_MJ_PER_J = 1e3

PERCENT = 100.0

SMALLEST_VISIBLE = 0.003
"""Share of the largest term below which a term is left out of the picture: its line would be too
thin to be seen. The table has it."""

OPACITY = 0.85
"""Opacity of the stacked terms: the grid is seen through them."""


def plot_forces(recording: Recording, title: str, path: Path) -> None:
    """Write a PNG: the force that the arm feels, the parts of it, and the area that was cut."""
    time = recording.column("time_s")
    figure = Figure(figsize=(8.0, 7.2))
    above, middle, below = figure.subplots(
        3, 1, sharex=True, height_ratios=(1.6, 1.2, 0.8), gridspec_kw=_FORCE_MARGINS
    )
    figure.suptitle(title, x=0.01, y=0.985, ha="left", fontsize=12, fontweight="bold")
    _plot_felt(above, time, recording)
    _plot_parts(middle, time, recording)
    _plot_area(below, time, recording)
    below.set_xlabel("time [s]")
    for axes in (above, middle, below):
        simplify(axes)
    figure.align_ylabels()
    FigureCanvasAgg(figure).print_figure(path, dpi=DOTS_PER_INCH, format="png")


def plot_energies(recording: Recording, title: str, path: Path) -> None:
    """Write a PNG: the terms of the account on top of each other, and the residual."""
    time = recording.column("time_s")
    work = sum(recording.column(f"work_of_{what}_j") for what in ("blade", "loads", "supports"))
    figure = Figure(figsize=(8.0, 5.8))
    above, below = figure.subplots(
        2, 1, sharex=True, height_ratios=(3.2, 1.0), gridspec_kw=_ENERGY_MARGINS
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


def simplify(axes: Axes) -> None:
    """Remove the parts of the frame that carry no information, and draw a light grid."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(color="0.9", lw=0.6)
    axes.set_axisbelow(True)
    axes.margins(x=0.0)


def legend(axes: Axes, n_columns: int) -> None:
    """Put the legend above the plot, where it hides nothing."""
    axes.legend(
        ncols=n_columns,
        frameon=False,
        loc="lower left",
        bbox_to_anchor=(0.0, 0.98),
        fontsize=8.5,
        borderaxespad=0.0,
        columnspacing=1.4,
        handlelength=1.4,
    )


def _plot_felt(axes: Axes, time: np.ndarray, recording: Recording) -> None:
    """Draw the force on the arm and, where the device limits it, the force of the tissue."""
    force, raw = recording.vector("force"), recording.vector("tissue_force")
    size, wanted = (np.linalg.norm(vectors, axis=1) for vectors in (force, raw))
    is_limited = np.abs(force - raw).max(axis=1, initial=0.0) > _SAME * wanted
    axes.plot(time, size, color=MAGNITUDE, lw=1.6, label="magnitude")
    for i, (axis, colour) in enumerate(COMPONENTS):
        axes.plot(time, force[:, i], color=colour, lw=1.0, label=f"${axis}$")
    if is_limited.any():
        axes.plot(time, wanted, color=LIMITED, lw=0.9, ls=":", label="of the tissue, unlimited")
        axes.fill_between(
            time, 0.0, 1.0, where=is_limited, transform=axes.get_xaxis_transform(),
            color=LIMITED, alpha=0.12, lw=0.0, label="the device limits it",
        )  # fmt: skip
    for i, name in enumerate(recording.hands):
        of_hand = recording.sizes(f"{name}_force")
        colour = HAND_COLOURS[i % len(HAND_COLOURS)]
        axes.plot(time, of_hand, color=colour, lw=1.3, ls="--", label=name)
    axes.set_ylabel("force on the arm [N]")
    legend(axes, 6)


def _plot_parts(axes: Axes, time: np.ndarray, recording: Recording) -> None:
    """Draw the parts of the force on the blade."""
    for name, label, colour in PARTS:
        size = recording.sizes(name)
        axes.plot(time, size, color=colour, lw=1.2, label=label)
    for i in range(min(recording.n_held, len(HELD))):
        size = recording.sizes(f"held_{i}")
        axes.plot(time, size, color=HELD[i], lw=1.0, ls="--", label=f"attachment {i + 1}")
    axes.set_ylabel("of which [N]" if recording.n_held == 0 else "of which; held [N]")
    axes.set_ylim(bottom=0.0)
    legend(axes, 3 + min(recording.n_held, len(HELD)))


def _plot_area(axes: Axes, time: np.ndarray, recording: Recording) -> None:
    area = recording.column("cut_area_m2") * _MM2_PER_M2
    axes.fill_between(time, area, color=_AREA, alpha=0.15, lw=0.0)
    axes.plot(time, area, color=_AREA, lw=1.6)
    axes.set_ylabel("cut area [mm²]")
    axes.set_ylim(bottom=0.0)
