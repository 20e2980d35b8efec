"""Warnings at the end of a run that did not do what was planned, and why, as far as it is seen.

Each check is a function of the outcome of a run, and `CHECKS` is the list of them.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.instruments.driven_grasper import GripSettings
from scalpel_sim.instruments.guarded_follower import DRAGGED, GAVE_UP, THROUGH
from scalpel_sim.output.cut_account import (
    MOST,
    Stretch,
    area_unpaid,
    energy_released,
    length_of_cut,
)
from scalpel_sim.output.label_figures import label_figures
from scalpel_sim.output.run_outcome import COMPLETE, RunOutcome

LEAST_SHARE = 0.95
"""Share of the area that a stroke is to cut from which on it is done: complete cuts of the shipped
scenes are within 0.99 to 1.05 of it, unfinished ones well below."""

_FACE = 2.0
"""Area that a cut may lack because the mesh resolves no less, in squares of the node size: the face
of a cell of a grid."""

_MOVED = 0.5
"""Motion of a body, or of a blade from its place, from which it is reported, in node sizes."""

_TURNED = math.radians(2.0)
"""By how much a body has turned before it is reported [rad]."""

_GIVEN_WAY = 5e-3
"""Excess of the edge's way in the tissue over what it cut from which it is reported [m]: any edge
drags tissue along by a few millimetres."""

_MM, _MM2 = 1e3, 1e6


class RunWarning(NamedTuple):
    """Something that was planned for a run and was not done."""

    kind: str
    """Name of the kind, which stays."""
    message: str
    """Problem, size and reason, in one line."""
    figures: dict[str, Any]
    """The numbers in it, by name. SI units; the names end in them."""

    def as_numbers(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {"kind": self.kind, "message": self.message} | self.figures


RunCheck = Callable[[RunOutcome], Iterator[RunWarning]]
"""Yields what is the matter with a run."""


def warnings_of(outcome: RunOutcome) -> list[RunWarning]:
    """Return what is to be said of a run: of the cut the first that is the matter, and all else."""
    found = []
    for checks in CHECKS:
        found += next((each for each in (list(check(outcome)) for check in checks) if each), [])
    return found


def _untouched(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of a blade that never touched the tissue."""
    recording = outcome.recording
    if not (outcome.is_stroke_over and outcome.was_to_touch):
        return
    if recording.column("anchored_length_m").any() or recording.sizes("tissue_force").any():
        return
    moved, _ = outcome.motion
    why = f": the body has moved by {_mm(moved)}" if _is_moved(outcome, moved) else ""
    yield RunWarning(
        "untouched", f"the blade never touched the tissue{why}", {"body_moved_m": moved}
    )


def _limited(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of strokes that were to part the body and have not, or gave up."""
    kinds = [each["kind"] for each in outcome.settings.get("strokes", ())]
    if outcome.status != COMPLETE or outcome.stroke.is_led:
        return
    guards = outcome.stroke.guards
    for i, guard in enumerate(guards):
        end = outcome.stroke_ends[i] if i < len(outcome.stroke_ends) else None
        how = "was not done" if end is None else f"ended {end.how} after {end.time:.3f} s"
        is_through = end is not None and end.how == THROUGH
        if guard.is_until_through and not is_through:
            kind, problem = "not_through", f"is not through: it {how}"
        elif end is not None and end.how == GAVE_UP:
            kind, problem = "gave_up", f"waited for the force to fall below {guard.force_limit:g} N"
            problem += f" and {how}"
        elif end is not None and end.how == DRAGGED:
            kind, problem = "dragged", f"{how}: hold the body, or let a second hand hold it taut"
        else:
            continue
        why, figures = _reasons(outcome)
        which = f"stroke {i + 1}" + (f", {kinds[i]}," if i < len(kinds) else "")
        stroke = {"stroke": i + 1, "ended": None if end is None else end.how}
        yield RunWarning(kind, f"{which} {problem}; {why}", stroke | figures)


def _spared(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of parts that were to be left whole, and were cut."""
    for part in label_figures(outcome):
        area = part["cut_area_m2"]
        if part["spare"] and area > 0.0:
            message = (
                f"{part['name']} was to be left whole; {_MM2 * area:.2g} mm\u00b2 of it were cut"
            )
            yield RunWarning("spared", message, {"label": part["label"], "cut_area_m2": area})


def _unfinished_cut(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of cuts that are smaller than they were to be, and say why."""
    if not outcome.is_stroke_over or not (areas := outcome.asked_areas):
        return
    ends = [start for start, _ in areas[1:]] + [outcome.seconds]
    for i, ((start, asked), end) in enumerate(zip(areas, ends, strict=True)):
        cut = outcome.cut_between(start, end)
        if asked - cut <= max((1.0 - LEAST_SHARE) * asked, _FACE * outcome.node_size**2):
            continue
        which = f"cut {i + 1} of {len(areas)}" if len(areas) > 1 else "the cut"
        pieces = "" if (lack := _lack_of_pieces(outcome)) is None else f", and {lack}"
        why, figures = _reasons(outcome)
        message = f"{cut * _MM2:,.0f} of {asked * _MM2:,.0f} mm² ({cut / asked:.0%}){pieces}"
        yield RunWarning(
            "unfinished_cut",
            f"{which} is unfinished: {message}; {why}",
            {"cut": i + 1, "cut_area_m2": cut, "asked_area_m2": asked}
            | {"pieces": outcome.n_pieces, "asked_pieces": outcome.asked_pieces}
            | figures,
        )


def _not_parted(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of a cut clean through that leaves fewer pieces than it was to."""
    if not outcome.is_stroke_over or (lack := _lack_of_pieces(outcome)) is None:
        return
    why, figures = _reasons(outcome)
    pieces = {"pieces": outcome.n_pieces, "asked_pieces": outcome.asked_pieces}
    yield RunWarning("not_parted", f"{lack}; {why}", pieces | figures)


def _nothing_cut(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of a stroke that was to cut wherever the body is, and cut nothing."""
    if not outcome.is_stroke_over or not outcome.was_to_cut:
        return
    if outcome.recording.at_end("cut_area_m2") > 0.0:
        return
    why, figures = _reasons(outcome)
    yield RunWarning(
        "nothing_cut", f"the blade touched the tissue, and cut nothing; {why}", figures
    )


def _blade_inside(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of a blade that is in the tissue where the stroke was to lead it out."""
    if not outcome.is_stroke_over or not outcome.edge_inside or outcome.is_to_end_inside:
        return
    why, figures = _reasons(outcome)
    yield RunWarning(
        "blade_inside", f"the blade did not leave the tissue as planned; {why}", figures
    )


def _failed_grasp(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of graspers that closed on nothing, or lost what they held, by the script of a scene."""
    recording, tables = outcome.recording, outcome.settings.get("graspers", ())
    for name, table in zip(recording.hands, tables, strict=False):
        if outcome.stroke.is_led or table.get("holds") == "friction":
            continue
        opening, holds = recording.column(f"{name}_opening_m"), recording.column(f"{name}_points")
        is_closed = opening < table.get("closed", GripSettings().closed)
        if is_closed.any() and not holds.any():
            problem = "closed, and no tissue was between its pads"
            yield RunWarning("empty_grasp", f"the grasper '{name}' {problem}", {"name": name})
        lost = np.flatnonzero((holds[:-1] > 0.0) & (holds[1:] == 0.0) & is_closed[1:])
        for frame in lost[:1].tolist():
            at = float(recording.column("time_s")[frame + 1])
            problem = f"lost what it held at {at:.3f} s, while it was closed"
            figures = {"name": name, "time_s": at}
            yield RunWarning("lost_grasp", f"the grasper '{name}' {problem}", figures)


def _energy_released(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of energy that is lost where the blade releases tissue, instead of cutting it."""
    # Attachments and ligaments that are released free energy, too.
    if not outcome.recording.is_audited or outcome.recording.n_held:
        return
    stretch = energy_released(outcome.recording)
    if stretch is None:
        return
    where, figures = _place(outcome, stretch)
    yield RunWarning(
        "energy_released",
        f"{stretch.share:.0%} of the energy ({stretch.amount * 1e3:.3g} of {stretch.of * 1e3:.3g} "
        f"mJ) was released instead of spent on the cut {where}: more than {MOST:.0%}, and the "
        "force there is not that of a cut",
        {"released_j": stretch.amount, "energy_j": stretch.of} | figures,
    )


def _area_unpaid(outcome: RunOutcome) -> Iterator[RunWarning]:
    """Warn of area that the mesh opened and the blade did not pay for."""
    if not outcome.recording.is_audited or outcome.toughness is None:
        return
    if not outcome.toughness.all():
        return
    stretch = area_unpaid(outcome.recording, outcome.toughness, outcome.node_size)
    if stretch is None:
        return
    where, figures = _place(outcome, stretch)
    yield RunWarning(
        "area_unpaid",
        f"the mesh opened {stretch.of * _MM2:,.0f} mm² and the blade paid for "
        f"{(stretch.of - stretch.amount) * _MM2:,.0f} mm² of it {where}: more than {MOST:.0%} "
        "less, and the force there is too small",
        {"opened_area_m2": stretch.of, "unpaid_area_m2": stretch.amount} | figures,
    )


CHECKS: tuple[tuple[RunCheck, ...], ...] = (
    (_untouched, _limited, _unfinished_cut, _not_parted, _nothing_cut, _blade_inside),
    (_failed_grasp,),
    (_energy_released,),
    (_area_unpaid,),
    (_spared,),
)
"""The checks of a run. Of those in one group the first that finds something speaks for the others,
which report the same."""


def _lack_of_pieces(outcome: RunOutcome) -> str | None:
    """Return how many pieces there are, if those are fewer than planned."""
    n, asked = outcome.n_pieces, outcome.asked_pieces
    if asked is None or n >= asked:
        return None
    return f"{n} {'piece is' if n == 1 else 'pieces are'} left where {asked} were to be"


def _reasons(outcome: RunOutcome) -> tuple[str, dict[str, float]]:
    """Return what is seen at the end of a run whose cut is not as planned, and its figures."""
    (moved, turned), supports = outcome.motion, outcome.motion_of_supports
    way, cut = outcome.forward_in_tissue, float(length_of_cut(outcome.recording)[-1])
    behind, friction, needed = (
        outcome.distance_behind,
        outcome.friction_of_table,
        outcome.expected_force,
    )
    found = []
    if _is_moved(outcome, moved) or turned > _TURNED:
        turn = f" and turned by {math.degrees(turned):.2g} degrees" if turned > _TURNED else ""
        held = f", what holds it by {_mm(supports)}" if outcome.first.fixed.any() else ""
        found.append(f"the body has moved by {_mm(moved)}{turn}{held}")
    if way > cut + _GIVEN_WAY:
        found.append(f"the edge went {_mm(way)} forward with tissue on it and cut {_mm(cut)}")
    if outcome.edge_inside > 0.0:
        found.append(
            f"the blade is still in it, with {_mm(outcome.edge_inside)} of its edge and "
            f"{outcome.force_at_end:.2g} N"
        )
    if friction is not None and needed is not None and friction < needed:
        found.append(
            f"friction with the table holds it with {friction:.2g} N, and the cut needs "
            f"{needed:.2g} N"
        )
    limited = outcome.counters.get("force_limited", 0)
    if limited:
        found.append(f"the force was above the limit of the arm in {limited:,} frames")
    if _is_moved(outcome, behind):
        found.append(f"the blade is {_mm(behind)} from where it was to end")
    figures = {
        "body_moved_m": moved,
        "body_turned_rad": turned,
        "supports_moved_m": supports,
        "forward_in_tissue_m": way,
        "edge_inside_m": outcome.edge_inside,
        "force_at_end_n": outcome.force_at_end,
        "blade_off_m": behind,
        "force_limited_frames": limited,
    }
    if friction is not None and needed is not None:
        figures |= {"friction_of_table_n": friction, "expected_force_n": needed}
    return "; ".join(found) or "why is not seen in its last state", figures


def _is_moved(outcome: RunOutcome, distance: float) -> bool:
    """Whether a distance [m] is worth telling on this mesh."""
    return distance > _MOVED * outcome.node_size


def _mm(length: float) -> str:
    """Return a length [m] in millimetres, for a message."""
    return f"{length * _MM:.3g} mm" if length < 1.0 else f"{length * _MM:,.0f} mm"


def _place(outcome: RunOutcome, stretch: Stretch) -> tuple[str, dict[str, Any]]:
    """Return where and when a stretch of a cut is, as words and figures."""
    frames = [stretch.first, stretch.last]
    times = outcome.recording.column("time_s")[frames] + outcome.dt
    tips = outcome.frame.points_to_tissue(outcome.recording.vector("tip")[frames])
    cut = length_of_cut(outcome.recording)[frames]
    places = [", ".join(f"{x * _MM:.1f}" for x in tip) for tip in tips]
    words = (
        f"from {times[0]:.3f} s (tip at {places[0]} mm of the tissue's frame) to {times[1]:.3f} s "
        f"(at {places[1]} mm), millimetres {cut[0] * _MM:.0f} to {cut[1] * _MM:.0f} of the cut"
    )
    return words, {
        "from_s": float(times[0]),
        "to_s": float(times[1]),
        "from_tip_m": tips[0].tolist(),
        "to_tip_m": tips[1].tolist(),
        "from_cut_m": float(cut[0]),
        "to_cut_m": float(cut[1]),
    }
