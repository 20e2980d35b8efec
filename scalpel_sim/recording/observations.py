"""`OBSERVATIONS`: arrays of a simulation by name, for `Simulation.observe`.

Quantities of the recording are observed by their names. What is not a row of numbers is an entry of
`OBSERVATIONS`: see `docs/extend.md`.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np

from bridge import InProcessLink, TissueFrame, TissueLink
from scalpel_sim.errors import UsageError, unknown
from scalpel_sim.recording.columns import ColumnGroup, FrameData
from tissue import (
    AddedMass,
    BodyContacts,
    FloatArray,
    MaterialPoints,
    RigidContacts,
    StageTimes,
    StateError,
    StepResult,
    Wrench,
)

N_POINTS = 64
"""Number of material points where none is given."""


class Observed(Protocol):
    """A simulation, as far as it is observed; see `simulation.Simulation`."""

    link: TissueLink
    frame: TissueFrame
    samples: "MaterialSamples"


Observation = Callable[[Observed, str], Mapping[str, np.ndarray]]
"""Returns arrays by name, copies in the world frame.

Its arguments are the simulation after a frame, and the text after a colon in the name that was
requested, empty where there is none."""


class MaterialSamples:
    """Material points that are observed: the same in each episode, however the body is cut.

    They are chosen when they are observed first: before a cut, so that another process chooses the
    same.
    """

    def __init__(self) -> None:
        self._rest: dict[int, FloatArray] = {}
        self._points: dict[int, MaterialPoints] = {}

    def relocate(self) -> None:
        """Find the points in the body again at the next observation: another state is loaded."""
        self._points.clear()

    def holders(self) -> dict[int, list[int]]:
        """Return the tetrahedron that holds each point, by their number: a part of a state."""
        return {n: points.last_holders.tolist() for n, points in self._points.items()}

    def hold(self, link: InProcessLink, holders: Mapping[int, list[int]]) -> None:
        """Continue from `holders`: a point on a face between two stays in its own one."""
        for n, tetrahedra in holders.items():
            self._points[n] = link.tissue.material_points(self._rest[n])
            self._points[n].last_holders[:] = tetrahedra

    def positions(self, link: TissueLink, n: int) -> FloatArray:
        """Return where `n` points of the skin are [m], tissue frame, shape (n, 3).

        Raises:
            StateError: the tissue is in another process.
        """
        if not isinstance(link, InProcessLink):
            raise StateError(
                "the tissue is in another process, and its material points cannot be observed over "
                "a link: run without --connect"
            )
        if n not in self._rest:
            surface = link.surface()
            skin = np.unique(surface.triangles[~surface.is_cut])
            self._rest[n] = farthest_points(surface.rest_positions[skin], n)
        if n not in self._points:
            self._points[n] = link.tissue.material_points(self._rest[n])
        return link.tissue.positions_of(self._points[n])


def farthest_points(places: FloatArray, n: int) -> FloatArray:
    """Return `n` of these places, each as far as possible from those before, shape (n, 3).

    Args:
        places: At least `n` places [m], shape (n_places, 3).
        n: How many are returned. The first is the one farthest from the mean of all.

    Raises:
        UsageError: there are fewer places.
    """
    if not 1 <= n <= len(places):
        raise UsageError(f"{n} points cannot be observed: the skin has 1 to {len(places)}")
    distance = np.linalg.norm(places - places.mean(axis=0), axis=1)
    chosen = [int(np.argmax(distance))]
    distance[:] = np.inf
    for _ in range(n - 1):
        np.minimum(distance, np.linalg.norm(places - places[chosen[-1]], axis=1), out=distance)
        chosen.append(int(np.argmax(distance)))
    return places[chosen]


def _surface(simulation: Observed, argument: str) -> dict[str, np.ndarray]:
    """Return the triangles of skin and cut faces: places [m], corners, and whether each is cut."""
    if argument:
        raise UsageError(f"'surface:{argument}': a surface is observed whole, as 'surface'")
    surface = simulation.link.surface()
    return {
        "surface_positions": simulation.frame.points_to_world(surface.positions),
        "surface_triangles": surface.triangles,
        "surface_is_cut": surface.is_cut,
    }


def _points(simulation: Observed, argument: str) -> dict[str, np.ndarray]:
    """Return where material points of the skin are [m]: as many as the argument says."""
    if argument and not argument.isdecimal():
        raise UsageError(f"'points:{argument}': after the colon comes how many, as in 'points:64'")
    n = int(argument or N_POINTS)
    places = simulation.samples.positions(simulation.link, n)
    return {
        f"points:{argument}" if argument else "points": simulation.frame.points_to_world(places)
    }


OBSERVATIONS: dict[str, Observation] = {"surface": _surface, "points": _points}
"""Observations besides the quantities of the recording, by name."""


def observed(
    simulation: Observed, groups: Sequence[ColumnGroup], frame: FrameData, names: Sequence[str]
) -> dict[str, np.ndarray]:
    """Return observations by name; see `Simulation.observe`.

    Args:
        simulation: The simulation after a frame.
        groups: Quantities that it records.
        frame: Its last frame.
        names: Names of quantities and observations.

    Raises:
        UsageError: there is none of that name, or one returns something other than arrays.
    """
    wanted, found = {name: name.partition(":") for name in names}, dict[str, np.ndarray]()
    for group in groups:
        if wanted.keys().isdisjoint(group.quantities):
            continue
        numbers, at = np.array(group.values(frame), np.float64), 0
        for name, columns in group.quantities.items():
            found[name] = numbers[at : at + len(columns)]
            at += len(columns)
    there = dict[str, np.ndarray]()
    for name, (kind, _, argument) in wanted.items():
        if name in found:
            there[name] = found[name]
        elif kind in OBSERVATIONS:
            there |= _arrays_of(kind, OBSERVATIONS[kind](simulation, argument))
        else:
            known = [*(each for group in groups for each in group.quantities), *OBSERVATIONS]
            raise unknown("observation", name, known)
    return there


def _arrays_of(kind: str, values: Mapping[str, np.ndarray]) -> Mapping[str, np.ndarray]:
    """Return what an observation returned.

    Raises:
        UsageError: a value is not an array.
    """
    for name, value in values.items():
        if not isinstance(value, np.ndarray):
            raise UsageError(
                f"observation {kind!r} returned a {type(value).__name__} as {name!r}; it must be "
                "an array of NumPy, also for a single number"
            )
    return values


def result_at_rest(link: TissueLink) -> StepResult:
    """Return the result of a tissue before its first step: nothing acts, and nothing is cut."""
    body, zero, none = link.describe(), np.zeros(3), np.zeros((0, 3))
    wrench = Wrench(zero, zero, zero)
    of_labels = np.zeros(len(body.labels) if len(body.labels) > 1 else 0)
    return StepResult(
        wrench=wrench,
        wrench_t1=wrench,
        stiffness=np.zeros((6, 6)),
        contacts=RigidContacts(
            none, none, np.zeros(0), none, np.zeros(0), np.zeros(0, dtype=np.int64)
        ),
        force_on_tissue=zero,
        bounds=body.bounds,
        n_tetrahedra=body.n_tetrahedra,
        n_nodes=body.n_nodes,
        n_active=0,
        active_point_tetrahedron=-1,
        anchored_length=0.0,
        cut_area=0.0,
        finished_area=0.0,
        work_of_blade=0.0,
        work_of_cutting=0.0,
        n_substeps=0,
        body_contacts=BodyContacts(0, 0.0, 0.0, zero),
        stage_times=StageTimes(0.0, 0.0, 0.0),
        added_mass=AddedMass(0.0, zero, zero, zero, zero),
        energies=None,
        cutting_of_labels=of_labels,
        force_of_labels=of_labels,
    )
