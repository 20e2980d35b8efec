"""Request and outcome of a run: what its summary and its warnings are made from."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from bridge import TissueDescription, TissueFrame
from scalpel_sim.instruments.blade_instrument import STROKE_TIME
from scalpel_sim.instruments.guarded_follower import AS_PLANNED, StrokeEnd
from scalpel_sim.recording.recording import Recording
from scalpel_sim.simulation import Simulation
from scalpel_sim.strokes.asked import asked_area, asked_pieces, first_areas, n_large
from scalpel_sim.strokes.expected_force import length_inside
from scalpel_sim.strokes.kinds import STROKES
from scalpel_sim.strokes.stroke import Stroke
from tissue import (
    CutFaces,
    CutReport,
    FloatArray,
    Piece,
    Snapshot,
    TetrahedralMesh,
    boundary_faces,
    fixed_nodes,
    pieces_of,
    toughness_law_of,
)
from tissue.support import components

COMPLETE = "complete"
"""Status of a run that reached its end; any other status says what ended it."""

_SAME_PLACE = 0.5
"""Distance within which a cut goes where one has gone before, in node sizes: it snaps to nodes that
are nearer than 0.3."""


@dataclass(frozen=True)
class RunOutcome:
    """A run that has ended, as `outcome_of` returns it. Lengths in metres, tissue frame."""

    recording: Recording
    dt: float
    """Simulated time of a frame [s]."""
    stroke: Stroke
    """Planned path of the blade."""
    frame: TissueFrame
    """Pose of the tissue in the world."""
    settings: dict[str, Any]
    """Settings from command line and scene; of a tissue elsewhere some are missing."""
    tissue: TissueDescription
    """Description of the tissue before the first frame, wherever it is."""
    first: Snapshot
    """The body before the first frame."""
    last: Snapshot | None
    """The body at the end; None where the link to the tissue was lost."""
    report: CutReport | None
    """Report on the cut at the end; None where the link to the tissue was lost."""
    cut_faces: CutFaces | None
    """All faces that were cut; None where the link to the tissue was lost."""
    status: str = COMPLETE
    """`complete`, or what ended the run before its time."""
    wall_seconds: float = 0.0
    """Wall time of the frame loop [s]."""
    tetrahedra_final: int = 0
    """Number of tetrahedra at the end."""
    asked_area: float | None = None
    """Area that the stroke was to cut [m2]; None where that is not known."""
    expected_force: float | None = None
    """Force of the cut if the body does not give way [N]; None where that is not known."""
    counters: dict[str, Any] = field(default_factory=dict)
    """Counters of the bridge."""
    touched: dict[str, int] = field(default_factory=dict)
    """Number of frames in which each pair of parts collided."""
    stroke_ends: Sequence[StrokeEnd] = ()
    """Ends of the strokes in turn, where a force or the body could end it."""
    held_points: Sequence[int] = ()
    """Number of points that each attachment holds at the end."""
    label_names: Mapping[int, str] = field(default_factory=dict)
    """Names of the labels of the body, as far as they are known."""
    score: dict[str, Any] | None = None
    """Figures of the score; None of a run without a task."""

    @cached_property
    def pieces(self) -> tuple[Piece, ...] | None:
        """Pieces at the end, the largest first; None where the link to the tissue was lost."""
        return None if self.last is None else pieces_of(self.last)

    @property
    def node_size(self) -> float:
        """Mean size of a node [m]."""
        assert self.report is not None
        return self.report.node_size

    @property
    def seconds(self) -> float:
        """Simulated time [s]."""
        return len(self.recording) * self.dt

    @property
    def is_stroke_over(self) -> bool:
        """Whether the run reached the end of a stroke that a script plans.

        One that ends before, as `seconds` may say, is not judged by what the stroke was to do; nor
        is a hand.
        """
        if self.stroke.guards:
            is_planned = all(end.how == AS_PLANNED for end in self.stroke_ends)
            return is_planned and len(self.stroke_ends) == len(self.stroke.guards)
        return not self.stroke.is_led and self.seconds >= self.stroke.duration

    @cached_property
    def stroke_times(self) -> FloatArray:
        """Time on the clock of the stroke at the start of each frame and at the end [s]."""
        if not self.stroke.guards:
            return np.append(self.recording.column("time_s"), self.seconds)
        clock = self.recording.column(f"{STROKE_TIME}_s")
        return np.append(clock, clock[-1:])

    @property
    def is_body_moved(self) -> bool:
        """Whether the scene moves the body: then it is elsewhere when the blade comes."""
        if self.recording.hands:
            return True
        if self.settings.get("supports"):
            return True
        if "attachments" not in self.settings:  # the tissue is elsewhere, and they may move it
            return self.recording.n_held > 0
        moves = {"displacements", "release_at", "breaks_at"}
        return any(moves & each.keys() for each in self.settings["attachments"])

    @cached_property
    def asked_areas(self) -> list[tuple[float, float]]:
        """Start [s] and area [m2] of each cut that was to be done, as far as is known."""
        if self.is_body_moved or self.stroke.is_led:
            return []
        return first_areas(self.stroke, self.first, _SAME_PLACE * self.node_size) or []

    @cached_property
    def asked_pieces(self) -> int | None:
        """Number of pieces that were to be left, crumbs left out; None: not known."""
        if self.is_body_moved or self.stroke.is_led:
            return None
        return asked_pieces(self.stroke, self.first, self.node_size)

    @cached_property
    def n_pieces(self) -> int:
        """Number of pieces, crumbs left out."""
        volumes = np.array([piece.rest_volume for piece in self.pieces or ()])
        return n_large(volumes, self.node_size)

    @property
    def was_to_cut(self) -> bool:
        """Whether the stroke says that it cuts, wherever the body is then."""
        kinds = [STROKES[each["kind"]] for each in self.settings.get("strokes", ())]
        return bool(self.stroke.asked) or any(kind.ends_inside for kind in kinds)

    @property
    def was_to_touch(self) -> bool:
        """Whether the blade is to touch the tissue, as far as that is known."""
        kinds = [STROKES[each["kind"]] for each in self.settings.get("strokes", ())]
        return not kinds or any(kind.meets for kind in kinds)

    def cut_between(self, start: float, end: float) -> float:
        """Return the area that was cut between two instants [m2]."""
        areas = self.recording.column("cut_area_m2")
        frames = [round(t / self.dt) for t in (start, end)]
        if self.stroke.guards:  # their clock may stand
            frames = np.searchsorted(self.stroke_times[:-1], (start, end)).tolist()
        before, after = (areas[:n] for n in frames)
        return float((after[-1] if len(after) else 0.0) - (before[-1] if len(before) else 0.0))

    @property
    def edge_inside(self) -> float:
        """Length of the edge that is in the tissue at the end [m]."""
        return self.recording.at_end("anchored_length_m")

    @property
    def force_at_end(self) -> float:
        """Force on the blade at the end [N]."""
        return float(np.linalg.norm([self.recording.at_end(f"force_{axis}_n") for axis in "xyz"]))

    @cached_property
    def is_to_end_inside(self) -> bool:
        """Whether the stroke ends in the body, if that lies as it did at first."""
        mesh = TetrahedralMesh(self.first.positions, self.first.tetrahedra)
        corners = mesh.positions[boundary_faces(mesh.tetrahedra)]
        return length_inside(self.stroke.pose(self.stroke.duration), mesh, corners) > 0.0

    @property
    def _last(self) -> Snapshot:
        assert self.last is not None
        return self.last

    @cached_property
    def motion(self) -> tuple[float, float]:
        """Motion of the body [m] and its turn [rad] as a rigid one: its largest piece."""
        n, last = len(self.first.positions), self._last
        ends = np.stack([np.repeat(last.tetrahedra[:, 0], 3), last.tetrahedra[:, 1:].ravel()], 1)
        _, label = components(len(last.positions), ends)
        kept = np.flatnonzero(label[:n] == np.bincount(label[:n]).argmax())
        return _rigid_motion(
            self.first.masses[kept], self.first.positions[kept], last.positions[kept]
        )

    @property
    def motion_of_cores(self) -> list[tuple[float, float] | None]:
        """Path [m] and turn [rad] of each rigid core; None where they are not known."""
        found: list[tuple[float, float] | None] = []
        first = self.first
        mesh = TetrahedralMesh(
            first.rest_positions, first.tetrahedra, first.labels, self.label_names
        )
        for row in self.settings.get("cores", []):
            if self.last is None:
                found.append(None)
                continue
            is_inside = fixed_nodes(mesh, row["where"], row.get("body"))
            core = np.flatnonzero(is_inside[mesh.tetrahedra].all(axis=1))
            before, after = (
                body.positions[body.tetrahedra[core]].reshape(-1, 3)
                for body in (self.first, self.last)
            )
            found.append(_rigid_motion(np.ones(len(before)), before, after))
        return found

    @property
    def motion_of_supports(self) -> float:
        """Mean displacement of the fixed nodes [m]; 0 where there are none."""
        held = np.flatnonzero(self.first.fixed)
        if not len(held):
            return 0.0
        moved = (self._last.positions[held] - self.first.positions[held]).mean(axis=0)
        return float(np.linalg.norm(moved))

    @cached_property
    def forward_in_tissue(self) -> float:
        """Way of the edge forward with tissue on it [m]."""
        tips = self.frame.points_to_tissue(self.recording.vector("tip"))
        ahead = (np.diff(tips, axis=0) * self.forwards[1:]).sum(axis=1)
        is_in = self.recording.column("anchored_length_m")[1:] > 0.0
        return float(np.maximum(ahead[is_in], 0.0).sum())

    @cached_property
    def forwards(self) -> FloatArray:
        """Direction in which the edge was to cut at the end of each frame, shape (n_frames, 3)."""
        times = self.recording.column("time_s") + self.dt
        if self.stroke.guards:
            times = self.stroke_times[1:]
        return np.array([self.stroke.pose(t).forward for t in times.tolist()]).reshape(-1, 3)

    @property
    def distance_behind(self) -> float:
        """Distance of the tip from where it was to be at the end [m]."""
        tip = np.array([self.recording.at_end(f"tip_{axis}_m") for axis in "xyz"])
        planned = self.stroke.pose(float(self.stroke_times[-1])).tip
        return float(np.linalg.norm(self.frame.points_to_tissue(tip) - planned))

    @cached_property
    def friction_of_table(self) -> float | None:
        """The most that friction with the table held the body with [N]; None where more held it.

        Its normal force is the weight on it, and what the blade pushed down when it pulled hardest.
        None as well where it rubs on each label with that label's own coefficient.
        """
        settings = self.settings
        others = self.first.fixed.any() or self.recording.hands or self.recording.n_held
        if settings.get("table") is None or "gravity" not in settings or others:
            return None
        given = settings.get("table_friction")
        if given is None and not self.has_one_material:
            return None
        friction = self.tissue.material.friction if given is None else given
        force = self.recording.vector("tissue_force")
        hardest = int(np.linalg.norm(force[:, :2], axis=1).argmax())
        corners = self.first.rest_positions[self.first.tetrahedra]
        volume = float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum()) / 6.0
        weight = self.tissue.material.density * volume * _downwards(settings["gravity"])
        return float(friction * max(weight + float(force[hardest, 2]), 0.0))

    @property
    def has_one_material(self) -> bool:
        """Whether all of the body is of one material, without a layer in it."""
        rows = (*self.settings.get("labels", ()), *self.settings.get("bodies", ()))
        return not (self.settings.get("interfaces") or any(row["material"] for row in rows))

    @cached_property
    def toughness(self) -> FloatArray | None:
        """Energy per area at the speed of the edge in each frame [J/m2]; None: not known."""
        if not self.has_one_material:
            return None
        law = toughness_law_of(self.tissue.material, self.tissue.blade)
        slow = np.full(len(self.recording), law.toughness)
        exponent, doubling_speed = float(law.exponent[0]), float(law.doubling_speed[0])
        if exponent == 0.0:
            return slow
        if self.stroke.is_led:
            return None
        middles = [self.stroke.pose(t) for t in self.stroke_times.tolist()]
        ways = np.diff([0.5 * (pose.tip + pose.heel) for pose in middles], axis=0)
        speeds = np.maximum((ways * self.forwards).sum(axis=1), 0.0) / self.dt
        return np.asarray(slow * (1.0 + (speeds / doubling_speed) ** exponent))


def _downwards(gravity: float | tuple[float, ...]) -> float:
    """Return the part of a gravity that presses on a table [m/s2]; that of a number is all."""
    return gravity if isinstance(gravity, (int, float)) else -gravity[2]


def outcome_of(
    simulation: Simulation,
    settings: dict[str, Any],
    tissue: TissueDescription,
    first: Snapshot,
    last: Snapshot | None,
    report: CutReport | None,
    status: str = COMPLETE,
) -> RunOutcome:
    """Return the outcome of a run.

    Args:
        simulation: After its last frame.
        settings: Settings from command line and scene.
        tissue: Description of the tissue before the first frame.
        first: The body before the first frame.
        last: The body at the end; None where the link to the tissue was lost.
        report: Report on the cut at the end; None where the link to the tissue was lost.
        status: `complete`, or what ended the run before its time.
    """
    bridge, stroke, score = simulation.bridge, simulation.stroke, simulation.score
    is_reached = last is not None
    if score is not None and is_reached:
        score.look(simulation)
    return RunOutcome(
        recording=simulation.recording,
        dt=simulation.dt,
        stroke=stroke,
        frame=simulation.frame,
        settings=settings,
        tissue=tissue,
        first=first,
        last=last,
        report=report,
        cut_faces=simulation.link.cut_faces() if is_reached else None,
        status=status,
        wall_seconds=simulation.wall_seconds,
        tetrahedra_final=(bridge.result or tissue).n_tetrahedra,
        # What graspers move is elsewhere when the blade comes.
        asked_area=None if simulation.graspers else asked_area(stroke, first),
        expected_force=simulation.expected_force,
        counters=bridge.counters.as_numbers(),
        touched=simulation.touching.frames,
        stroke_ends=() if simulation.blade.progress is None else simulation.blade.progress.ends,
        held_points=[load.n_points for load in bridge.frame_loads],
        label_names=simulation.link.label_names,
        score=None if score is None else score.figures(),
    )


def _rigid_motion(masses: FloatArray, before: FloatArray, after: FloatArray) -> tuple[float, float]:
    """Return how far points have moved [m] and turned [rad] as a rigid body.

    Args:
        masses: Their weights, shape (n,).
        before: Where they were [m], shape (n, 3).
        after: Where they are [m], shape (n, 3).
    """
    shares = masses[:, None] / masses.sum()
    centres = (shares * before).sum(axis=0), (shares * after).sum(axis=0)
    # Kabsch 1976, Acta Cryst. A32:922.
    left, _, right = np.linalg.svd((shares * (before - centres[0])).T @ (after - centres[1]))
    mirror = np.diag([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    cosine = 0.5 * (float(np.trace(left @ mirror @ right)) - 1.0)
    return float(np.linalg.norm(centres[1] - centres[0])), float(np.arccos(min(cosine, 1.0)))
