"""The figures of a run: what `summary.json` holds and the table prints."""

import json
import platform
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.output.interface_figures import interface_figures
from scalpel_sim.output.label_figures import label_figures
from scalpel_sim.output.run_outcome import RunOutcome
from scalpel_sim.output.run_warnings import RunWarning
from scalpel_sim.recording.columns import ACCOUNT
from scalpel_sim.recording.recording import Recording
from scalpel_sim.version import version
from tissue import CutReport, Piece

STAGES = {"RX": "rx_s", "RD": "rd_s", "GC": "gc_s", "CD": "cd_s"}
"""The stages of the paper's Table 1, in its order, and the columns of the recording with their
times: relaxation, rendering, geometric changes, collision detection."""

PACKAGES = ("scalpel-sim", "numpy", "numba", "mujoco")

MACHINE = "SGI Indigo 2, R10000, 180 MHz"


class PaperRow(NamedTuple):
    """One row of Table 1. The frame rate is averaged over the cut."""

    tetrahedra_initial: int
    tetrahedra_final: int
    frame_rate: float
    percent: dict[str, float]
    """Share of each stage [%]: RX relaxation, RD rendering, GC geometric changes, CD collision
    detection."""


TABLE_1 = {
    (2, 2, 2): PaperRow(48, 354, 3.78, {"RX": 82.1, "RD": 11.4, "GC": 1.7, "CD": 0.3}),
    (2, 4, 3): PaperRow(144, 960, 2.24, {"RX": 88.9, "RD": 7.8, "GC": 0.4, "CD": 0.4}),
    (4, 6, 4): PaperRow(576, 2446, 1.14, {"RX": 92.2, "RD": 4.9, "GC": 0.1, "CD": 0.5}),
}
"""Rows of Table 1, by the number of cells along x, y and z."""


class Summary(NamedTuple):
    """The figures of one run. SI units; the names end in them."""

    scene: str
    status: str
    """`complete`, or what ended the run before its time."""
    simulated_seconds: float
    wall_seconds: float
    """Wall time of the frame loop, pictures included, compilation and files excluded."""
    real_time_factor: float
    """Simulated time over wall time: above 1 is faster than real time."""
    frames: int
    frame_rate_median: float
    """Whole frames (arm, bridge, CD, GC, RX; no pictures) per second, at the median frame time."""
    frame_rate_p99: float
    """Frames per second at the 99th percentile of the frame time: 1 frame in 100 is slower."""
    tetrahedra_initial: int
    tetrahedra_final: int
    pieces: int | None
    """None where the link to the tissue was lost."""
    each_piece: list[dict[str, Any]]
    """Mass properties of the pieces (`tissue.Piece`), the largest first."""
    quality: dict[str, float] | None
    """Quality of the cut: how closely it follows the blade, and what it did to the mesh; None where
    the link was lost."""
    cut_area_m2: float
    asked_area_m2: float | None
    """The area that the stroke was to cut, in the body at rest; None where that is not known."""
    finished_area_m2: float
    """The part of the cut area that no blade cut: small bridges that were finished."""
    cut_area_paid_m2: float | None
    """The area that the blade paid for: work of cutting over toughness. None without an audit, or
    where the toughness depends on speed, skin or sharpness."""
    force_peak_n: float
    """Largest force on the blade, after the device's limits."""
    force_mean_n: float
    """Mean magnitude of the force on the blade over the frames in which there was any."""
    strokes: list[dict[str, Any]]
    """End of each stroke, and its time, where a force or the body could end it: `kind`, `ended`,
    `time_s`, `force_n`."""
    labels: list[dict[str, Any]]
    """Of each labelled part of the body: `label`, `name`, `spare`, `volume_m3`, `cut_area_m2`, in
    how many pieces it is, `work_of_cutting_j`, and `edge_force_peak_n`, the largest force on the
    edge. Empty without labels."""
    interfaces: list[dict[str, Any]]
    """Of each layer between two parts: `between`, `toughness_j_m2`, `area_m2` at rest, and
    `cut_area_m2`, how much of it was cut."""
    score: dict[str, Any] | None
    """The score against the task (`scoring.score.Score.figures`); None of a run without one."""
    cores: list[dict[str, Any]]
    """Of each rigid core: how far it has moved and turned from the first frame to the last."""
    attachments: list[dict[str, Any]]
    """Of each attachment: what it held, how many points in the end, and its forces."""
    work_of_blade_j: float
    energies_j: dict[str, float] | None
    """The energy account: the terms of `tissue.Energies`, and their `residual`. None without an
    audit."""
    residual_of_work: float | None
    """The residual over the work of all hands: of the blade, and the most that loads and graspers
    had done. None without an audit, or without work."""
    hands: list[dict[str, Any]]
    """Figures of what each grasper felt: see `hand_figures`."""
    share: dict[str, float]
    """Fractions of `wall_seconds`: the paper's RX, RD, GC, CD, and `other` (arm, bridge, link,
    recording). They sum to 1."""
    counters: dict[str, Any]
    """Counters of the bridge: broad-phase rejections, saturations and others."""
    touched: dict[str, int]
    """In how many frames a part of the arm collided, by "PART, FIXTURE OR PART"."""
    warnings: list[dict[str, Any]]
    """Requests that the run did not fulfil: `kind`, `message`, and the figures of the kind."""
    settings: dict[str, Any]
    """The resolved settings of the run: material, stroke, arm."""
    versions: dict[str, str]


def summarise(outcome: RunOutcome, warnings: Iterable[RunWarning] = ()) -> Summary:
    """Return the summary of a run and its warnings."""
    recording, seconds, wall_seconds = outcome.recording, outcome.seconds, outcome.wall_seconds
    n, pieces, report = len(recording), outcome.pieces, outcome.report
    force = recording.sizes("force")
    felt = force[force > 0.0]
    frame_times = recording.column("frame_s")
    median, slow = np.percentile(frame_times, (50, 99)) if n else (np.inf, np.inf)
    energies = final_energies(recording)
    work = recording.at_end("work_of_blade_j")
    return Summary(
        scene=outcome.tissue.scene,
        status=outcome.status,
        simulated_seconds=seconds,
        wall_seconds=wall_seconds,
        real_time_factor=seconds / wall_seconds if n else 0.0,
        frames=n,
        frame_rate_median=float(1.0 / median),
        frame_rate_p99=float(1.0 / slow),
        tetrahedra_initial=outcome.tissue.n_tetrahedra,
        tetrahedra_final=outcome.tetrahedra_final,
        pieces=None if pieces is None else len(pieces),
        each_piece=[_as_numbers(piece) for piece in pieces or ()],
        quality=None if report is None else quality_figures(report),
        cut_area_m2=recording.at_end("cut_area_m2"),
        asked_area_m2=outcome.asked_area,
        finished_area_m2=recording.at_end("finished_area_m2"),
        cut_area_paid_m2=_area_paid_for(energies, outcome),
        force_peak_n=float(force.max(initial=0.0)),
        force_mean_n=float(felt.mean()) if len(felt) else 0.0,
        strokes=_strokes(outcome),
        labels=label_figures(outcome),
        interfaces=interface_figures(outcome),
        score=outcome.score,
        cores=_cores(outcome),
        attachments=_attachments(outcome),
        work_of_blade_j=work,
        energies_j=energies,
        residual_of_work=_residual_of_work(recording, energies, work),
        hands=[hand_figures(recording, name) for name in recording.hands],
        share=shares(recording, wall_seconds),
        counters=outcome.counters,
        touched=outcome.touched,
        warnings=[warning.as_numbers() for warning in warnings],
        settings=outcome.settings,
        versions=versions(),
    )


def _residual_of_work(
    recording: Recording, energies: dict[str, float] | None, work: float
) -> float | None:
    """Return the residual over the work of all hands; None without an account, or without work."""
    if energies is None:
        return None
    # What is lifted and put down again takes work that is given back.
    work_of_loads = np.abs(recording.column("work_of_loads_j")).max(initial=0.0)
    in_all = work + float(work_of_loads)
    return energies["residual"] / in_all if in_all else None


def hand_figures(recording: Recording, name: str) -> dict[str, Any]:
    """Return what a grasper felt: peak force and torque, and how many points it held at most."""
    force, torque = (recording.sizes(f"{name}_{what}") for what in ("force", "torque"))
    points = recording.column(f"{name}_points")
    return {
        "name": name,
        "force_peak_n": float(force.max(initial=0.0)),
        "torque_peak_nm": float(torque.max(initial=0.0)),
        "points_held_most": int(points.max(initial=0.0)),
        "points_held_at_end": int(points[-1]) if len(points) else 0,
    }


def _strokes(outcome: RunOutcome) -> list[dict[str, Any]]:
    """Return how strokes with guards have ended."""
    rows = outcome.settings.get("strokes", ())
    force, found = outcome.recording.sizes("force"), []
    for i, end in enumerate(outcome.stroke_ends):
        frame = max(round(end.time / outcome.dt) - 1, 0)  # whose force was felt then
        kind = rows[i]["kind"] if i < len(rows) else ""
        felt = float(force[frame]) if frame < len(force) else 0.0
        found.append({"kind": kind, "ended": end.how, "time_s": end.time, "force_n": felt})
    return found


def _cores(outcome: RunOutcome) -> list[dict[str, Any]]:
    """Return the figures of the rigid cores."""
    found: list[dict[str, Any]] = []
    for row, motion in zip(outcome.settings.get("cores", []), outcome.motion_of_cores, strict=True):
        moved, turned = (None, None) if motion is None else motion
        found.append({"where": row["where"], "moved_m": moved, "turned_rad": turned})
    return found


def _attachments(outcome: RunOutcome) -> list[dict[str, Any]]:
    """Return the figures of the attachments."""
    tables, n_points = outcome.settings.get("attachments", []), outcome.held_points
    found = []
    for i in range(outcome.recording.n_held):
        sizes = outcome.recording.sizes(f"held_{i}")
        found.append(
            {
                "where": tables[i]["where"] if i < len(tables) else "",
                "points": n_points[i] if i < len(n_points) else None,
                "force_peak_n": float(sizes.max(initial=0.0)),
                "force_at_end_n": float(sizes[-1]) if len(sizes) else 0.0,
            }
        )
    return found


def _area_paid_for(energies: dict[str, float] | None, outcome: RunOutcome) -> float | None:
    """Return the work of cutting over the toughness [m2]; None where there is no one toughness."""
    material = outcome.settings.get("material", {}) if outcome.has_one_material else {}
    toughness = material.get("toughness", 0.0)
    others = ("skin_toughness", "toughness_exponent", "work_to_rupture")
    if energies is None or not toughness or any(material.get(name) for name in others):
        return None
    area: float = energies["cutting"] / toughness
    return area


def _as_numbers(piece: Piece) -> dict[str, Any]:
    """Return a piece as numbers with their units, for JSON."""
    return {
        "tetrahedra": piece.n_tetrahedra,
        "held": piece.is_held,
        "volume_m3": piece.volume,
        "rest_volume_m3": piece.rest_volume,
        "mass_kg": piece.mass,
        "centre_m": piece.centre.tolist(),
        "velocity_m_s": piece.velocity.tolist(),
        "angular_velocity_rad_s": piece.angular_velocity.tolist(),
        "inertia_kg_m2": piece.inertia.tolist(),
    }


def quality_figures(report: CutReport) -> dict[str, float]:
    """Return the distance of the cut from the blade's path, and its effect on mesh and step."""
    return {
        "path_error_mean_m": report.path_error_mean,
        "path_error_largest_m": report.path_error_largest,
        "path_error_mean_node_sizes": report.path_error_mean / report.node_size,
        "path_error_largest_node_sizes": report.path_error_largest / report.node_size,
        "node_size_m": report.node_size,
        "guard_m": report.guard,
        "smallest_altitude_initial_m": report.initial.altitude,
        "smallest_altitude_m": report.now.altitude,
        "tetrahedra_growth": report.growth,
        "frequency_growth": report.frequency_growth,
        "substep_growth": report.substep_growth,
        "added_mass": report.now.added_mass,
        "most_added_mass": report.now.most_added_mass,
        "inverted": report.now.inverted,
    }


def final_energies(recording: Recording) -> dict[str, float] | None:
    """Return the energy account at the last frame [J]; None without an audit."""
    if not recording.is_audited:
        return None
    names = ("work_of_blade_j", *ACCOUNT)
    return {name.removesuffix("_j"): recording.at_end(name) for name in names}


def shares(recording: Recording, wall_seconds: float) -> dict[str, float]:
    """Return the fraction of the wall time that each stage took; `other` is the rest."""
    total = wall_seconds if wall_seconds > 0.0 else 1.0
    share = {stage: float(recording.column(name).sum()) / total for stage, name in STAGES.items()}
    return share | {"other": 1.0 - sum(share.values())}


def versions() -> dict[str, str]:
    """Return the versions of packages, Python and platform, on which the figures depend."""
    found = {name.replace("-", "_"): version(name) for name in PACKAGES}
    return found | {"python": platform.python_version(), "platform": platform.platform()}


def summary_json(summary: Summary) -> str:
    """Return the summary as JSON text, with null for each number that is not finite."""
    numbers = json.loads(json.dumps(summary._asdict()), parse_constant=lambda _: None)
    return json.dumps(numbers, indent=2, allow_nan=False)
