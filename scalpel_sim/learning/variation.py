"""`Variation`: what differs from episode to episode, drawn and applied to a prepared simulation.

All of it is state: a simulation that is put back to its start is as it was, and what was drawn
before leaves nothing behind.
"""

import itertools
import logging
import math
from collections.abc import Mapping
from numbers import Real

import numpy as np
from msgspec import structs

from bridge import InProcessLink
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.learning.line_motion import LineMotion
from scalpel_sim.scene.arm_tables import BLADE_NAME
from scalpel_sim.scene.observe_table import SensorTable
from scalpel_sim.scene.scene import Scene
from scalpel_sim.scene.vary_table import OF_LAYER, OF_LINE, OF_MATERIAL, OF_START
from scalpel_sim.scoring.plan import skin_at_rest
from scalpel_sim.scoring.score import Score
from scalpel_sim.scoring.yardstick import with_line
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.kind import StrokeTable
from tissue import BoolArray, FloatArray
from tissue.support import labels_of_part

_log = logging.getLogger("scalpel_sim")

MOST_SLOWED = 1.5
"""Ratio of the numbers of steps of the body that needs most and of the prepared one without a
warning: then the slowest episode takes half as long again."""


class Variation:
    """Numbers that `[[vary]]` of a scene draws for each episode of its simulation.

    Args:
        simulation: At its start, prepared from the scene in this process.
        scene: The scene.

    Raises:
        UsageError: the line of the task is moved off the body within its range.
    """

    def __init__(self, simulation: Simulation, scene: Scene) -> None:
        self._simulation, self._scene, self._rows = simulation, scene, scene.vary
        link = simulation.link
        assert isinstance(link, InProcessLink)
        self._tissue, self._body = link.tissue, link.snapshot()
        self._where = {
            row.label: self._tetrahedra_of(row.label)
            for row in scene.vary
            if row.what in OF_MATERIAL and row.label is not None
        }
        self._line: LineMotion | None = None
        if any(row.what in OF_LINE for row in scene.vary):
            score = simulation.score
            assert scene.task is not None and isinstance(score, Score)
            self._skin, self._yardstick = skin_at_rest(self._body), score.yardstick
            self._line = LineMotion(scene.task, self._body)
            self._expect_lines_on_body()
        self._warn_of_steps()

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the numbers of a draw, in order."""
        return tuple(row.name for row in self._rows)

    def draw(self, rng: np.random.Generator) -> dict[str, float]:
        """Return the numbers of an episode by name: one draw of the generator each, in order."""
        return {row.name: row.drawn(rng) for row in self._rows}

    def checked(self, given: Mapping[str, float]) -> dict[str, float]:
        """Return numbers that are given by name, such as `draw` has returned them, in order.

        Raises:
            UsageError: a name is unknown or missing, or a number is out of its range.
        """
        if not isinstance(given, Mapping):
            raise UsageError(
                f"the variation is {given!r}; it is the numbers of [[vary]] by name, as info has it"
            )
        for name in map(str, given):
            if name not in self.names:
                raise unknown("number of [[vary]]", name, self.names)
        found: dict[str, float] = {}
        for row in self._rows:
            if row.name not in given:
                raise UsageError(
                    f"the variation has no {row.name}; it has all of [[vary]], or none"
                )
            number, (low, high) = given[row.name], row.range
            if not isinstance(number, Real) or not low <= float(number) <= high:
                raise UsageError(
                    f"{row.name} of the variation is {number!r}; [[vary]] has {low:g} to {high:g}"
                )
            found[row.name] = float(number)
        return found

    def apply(self, drawn: Mapping[str, float]) -> None:
        """Change the simulation, which was just put back to its start.

        Args:
            drawn: All numbers, by name.

        Raises:
            UsageError: the line of the task is moved off the body.
        """
        self._change_materials(drawn)
        if self._line is not None:
            score = self._simulation.score
            assert isinstance(score, Score)
            task = self._line.moved_task(self._line_numbers(drawn))
            score.compare_with(with_line(self._yardstick, task, self._body, self._skin))

    def strokes(self, drawn: Mapping[str, float]) -> tuple[StrokeTable, ...]:
        """Return the strokes of the scene; those that are traced are moved with the line."""
        if self._line is None:
            return self._scene.strokes
        motion = self._line_numbers(drawn)
        return tuple(self._line.moved_stroke(row, motion) for row in self._scene.strokes)

    def sensor(self, settings: SensorTable, drawn: Mapping[str, float]) -> SensorTable:
        """Return the errors of the force sensor, those that vary in place of others."""
        own = {
            key: drawn[f"sensor.{key}"]
            for key in settings.__struct_fields__
            if f"sensor.{key}" in drawn
        }
        return structs.replace(settings, **own)

    def starts(self, drawn: Mapping[str, float]) -> dict[str, FloatArray]:
        """Return by how much hands start elsewhere, by name [m], tissue frame, shape (3,) each."""
        found: dict[str, FloatArray] = {}
        for row in self._rows:
            if row.what in OF_START:
                at = found.setdefault(row.hand or BLADE_NAME, np.zeros(3))
                at[OF_START.index(row.what)] = drawn[row.name]
        return found

    def _tetrahedra_of(self, label: str) -> BoolArray:
        """Return which tetrahedra are of a part, shape (n_tets,)."""
        labels = self._tissue.labels()
        numbers = labels_of_part(np.unique(labels).tolist(), self._tissue.label_names, label)
        return np.isin(labels, numbers)

    def _change_materials(self, drawn: Mapping[str, float]) -> None:
        """Multiply quantities of materials and layers, all of materials at once."""
        factors: dict[str, float | FloatArray] = {}
        for row in self._rows:
            _, _, quantity = row.what.partition(".")
            if row.what == OF_LAYER:
                self._tissue.set_material(row.between, toughness=drawn[row.name])
            elif row.what in OF_MATERIAL:
                factor: float | FloatArray = drawn[row.name]
                if row.label is not None:
                    factor = np.where(self._where[row.label], factor, 1.0)
                factors[quantity] = factors.get(quantity, 1.0) * factor
        if factors:
            self._tissue.set_material(None, **factors)

    def _line_numbers(self, drawn: Mapping[str, float]) -> tuple[float, float, float]:
        """Return how far the line moves along itself and across [m], and turns [degree]."""
        along, across, turn = (drawn.get(name, 0.0) for name in OF_LINE)
        return along, across, turn

    def _expect_lines_on_body(self) -> None:
        """Refuse ranges at whose ends the line is off the body."""
        assert self._line is not None
        rows = [row for row in self._rows if row.what in OF_LINE]
        for ends in itertools.product(*(row.range for row in rows)):
            drawn = {row.name: end for row, end in zip(rows, ends, strict=True)}
            task = self._line.moved_task(self._line_numbers(drawn))
            try:
                with_line(self._yardstick, task, self._body, self._skin)
            except UsageError as error:
                numbers = ", ".join(f"{name} {number:g}" for name, number in drawn.items())
                raise UsageError(f"[[vary]] with {numbers}: {error}") from error

    def _warn_of_steps(self) -> None:
        """Warn of ranges with which a body needs many more steps of the integrator."""
        stiffest, lightest = (
            math.prod(row.range[end] for row in self._rows if row.what == f"material.{name}")
            for name, end in (("young_modulus", 1), ("density", 0))
        )
        slowed = math.sqrt(stiffest / lightest)
        if slowed > MOST_SLOWED:
            _log.warning(
                "[[vary]] makes bodies that take up to %.2g times as many steps as the prepared "
                "one, and episodes as much slower: the number of steps goes with the root of "
                "material.young_modulus over material.density. A factor of up to %.3g takes %.2g "
                "times as many",
                slowed,
                MOST_SLOWED**2,
                MOST_SLOWED,
            )
