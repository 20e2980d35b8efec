"""A plot of force and cut area beside a film, up to its present."""

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from scalpel_sim.camera.canvas import PixelSize
from scalpel_sim.output.plots import HAND_COLOURS, MAGNITUDE, simplify
from scalpel_sim.simulation import Simulation

_DOTS = 100
"""Pixels per inch, on which the size of the text depends at a height of `_USUAL` pixels."""

_USUAL = 480

_MARGINS = {"left": 0.17, "right": 0.96, "bottom": 0.12, "top": 0.95, "hspace": 0.14}

_LEAST = 0.1
"""Force up to which the axis goes at least [N]: less is noise, which should look so."""

_MM2_PER_M2 = 1e6


class ForcePanel:
    """Draws the forces of a run up to now, beside its film.

    Args:
        graspers: Names of the graspers of the run.
        seconds: Time that the axis has room for [s].
        size: Size of the plot [pixels].
    """

    def __init__(self, graspers: Sequence[str], seconds: float, size: PixelSize) -> None:
        dots = _DOTS * size.height / _USUAL
        self._figure = Figure((size.width / dots, size.height / dots), dots, facecolor="white")
        self._canvas = FigureCanvasAgg(self._figure)
        self._above, self._below = self._figure.subplots(
            2, 1, sharex=True, height_ratios=(2.0, 1.0), gridspec_kw=_MARGINS
        )
        n = len(graspers)
        colours = [MAGNITUDE, *(HAND_COLOURS[i % len(HAND_COLOURS)] for i in range(n))]
        self._lines = [
            self._above.plot([], [], color=colour, lw=1.4, label=name)[0]
            for name, colour in zip(["blade", *graspers], colours, strict=True)
        ]
        (self._area,) = self._below.plot([], [], color=MAGNITUDE, lw=1.4)
        self._above.set_xlim(0.0, seconds)
        self._above.set_ylabel("force [N]")
        self._below.set_ylabel("cut [mm²]")
        self._below.set_xlabel("time [s]")
        if graspers:
            self._above.legend(loc="upper left", fontsize=8, frameon=False)
        for axes in (self._above, self._below):
            simplify(axes)
        self._figure.align_ylabels()
        self._rows: list[tuple[float, ...]] = []

    def add(self, time: float, cut_area: float, forces: Iterable[float]) -> None:
        """Add an instant.

        Args:
            time: The instant [s].
            cut_area: Area cut until then [m2].
            forces: Force on the blade and on each grasper [N].
        """
        self._rows.append((time, _MM2_PER_M2 * cut_area, *forces))

    def add_frame(self, simulation: Simulation) -> None:
        """Add the frame of a simulation that was done."""
        wrenches = (simulation.wrench, *(each.wrench for each in simulation.graspers))
        forces = (math.hypot(*wrench.force) for wrench in wrenches)
        self.add(simulation.time, simulation.result.cut_area, forces)

    def picture(self) -> np.ndarray:
        """Return the plot up to now as bytes of red, green and blue, shape (height, width, 3)."""
        time, area, *forces = np.array(self._rows or [(0.0,) * (2 + len(self._lines))]).T
        for line, values in zip(self._lines, forces, strict=True):
            line.set_data(time, values)
        self._area.set_data(time, area)
        self._above.set_ylim(0.0, _round_up(max(_LEAST, *(each.max() for each in forces))))
        self._below.set_ylim(0.0, _round_up(max(1.0, float(area.max()))))
        canvas: Any = self._canvas  # of which matplotlib says no types
        canvas.draw()
        return np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _round_up(value: float) -> float:
    """Return the end of an axis: a little more than a value, in steps, so that it rests mostly."""
    step = 10.0 ** math.floor(math.log10(value)) / 2.0
    return step * math.ceil(1.05 * value / step)
