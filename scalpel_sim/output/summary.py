"""A run in twenty numbers: what `summary.json` holds and the table prints."""

import platform
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from scalpel_sim.output.recording import ACCOUNT, Recording
from scalpel_sim.version import version
from tissue import CutReport, Piece

COMPLETE = "complete"
"""The status of a run that reached its end; any other status says what ended it."""

STAGES = {"RX": "rx_s", "RD": "rd_s", "GC": "gc_s", "CD": "cd_s"}
"""The columns of the paper's Table 1, and where the recording keeps them."""

PACKAGES = ("scalpel-sim", "numpy", "numba", "mujoco")


class Summary(NamedTuple):
    """The figures of one run. SI units; the names end in them."""

    scene: str
    status: str
    """`complete`, or what ended the run before its time."""
    seed: int
    simulated_seconds: float
    wall_seconds: float
    """Wall time of the frame loop, pictures included, compilation and files excluded."""
    real_time_factor: float
    """Simulated time over wall time: above 1 is faster than life."""
    frames: int
    frame_rate_median: float
    """Whole frames (arm, bridge, CD, GC, RX; no pictures) a second, at the median frame time."""
    frame_rate_p99: float
    """The same at the 99th percentile of the frame time: 1 frame in 100 is slower."""
    tetrahedra_initial: int
    tetrahedra_final: int
    pieces: int | None
    """None where the link to the tissue was lost."""
    each_piece: list[dict[str, Any]]
    """The pieces, the largest first: see `tissue.Piece`."""
    quality: dict[str, float] | None
    """Path error against time step, see `quality_figures`; None where the link was lost."""
    cut_area_m2: float
    force_peak_n: float
    """Largest force that the blade felt, after the device's limits."""
    force_mean_n: float
    """Mean of its magnitude over the frames in which the blade felt any."""
    work_of_blade_j: float
    energies_j: dict[str, float] | None
    """Where it went: see `tissue.Energies`, and `residual`, which is not accounted for. None
    without an audit."""
    residual_of_work: float | None
    """The residual over the work of the blade; None without an audit, or without work."""
    share: dict[str, float]
    """Fractions of `wall_seconds`: the paper's RX, RD, GC, CD, and `other` (arm, bridge, link).
    They sum to 1."""
    counters: dict[str, Any]
    """What the bridge had to do: broad-phase rejections, saturations and the like."""
    touched: dict[str, int]
    """In how many frames a part of the arm met what it must not: "PART, FIXTURE OR PART"."""
    settings: dict[str, Any]
    """The resolved settings of the run: material, stroke, arm."""
    versions: dict[str, str]


def summarise(
    recording: Recording,
    *,
    scene: str,
    status: str,
    seed: int,
    dt: float,
    wall_seconds: float,
    tetrahedra_initial: int,
    tetrahedra_final: int,
    pieces: Sequence[Piece] | None,
    quality: CutReport | None,
    counters: dict[str, Any],
    touched: dict[str, int],
    settings: dict[str, Any],
) -> Summary:
    """Return the figures of a run whose frames of `dt` [s] took `wall_seconds` in all."""
    n = len(recording)
    force = np.linalg.norm(recording.vector("force"), axis=1)
    felt = force[force > 0.0]
    frame_times = recording.column("frame_s")
    median, slow = np.percentile(frame_times, (50, 99)) if n else (np.inf, np.inf)
    energies = final_energies(recording)
    work = float(recording.column("work_of_blade_j")[-1]) if n else 0.0
    return Summary(
        scene=scene,
        status=status,
        seed=seed,
        simulated_seconds=n * dt,
        wall_seconds=wall_seconds,
        real_time_factor=n * dt / wall_seconds if n else 0.0,
        frames=n,
        frame_rate_median=float(1.0 / median),
        frame_rate_p99=float(1.0 / slow),
        tetrahedra_initial=tetrahedra_initial,
        tetrahedra_final=tetrahedra_final,
        pieces=None if pieces is None else len(pieces),
        each_piece=[_as_numbers(piece) for piece in pieces or ()],
        quality=None if quality is None else quality_figures(quality),
        cut_area_m2=float(recording.column("cut_area_m2")[-1]) if n else 0.0,
        force_peak_n=float(force.max(initial=0.0)),
        force_mean_n=float(felt.mean()) if len(felt) else 0.0,
        work_of_blade_j=work,
        energies_j=energies,
        residual_of_work=energies["residual"] / work if energies and work else None,
        share=shares(recording, wall_seconds),
        counters=counters,
        touched=touched,
        settings=settings,
        versions=versions(),
    )


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
    """Return how far the cut is off the blade's path, and what it did to elements and time step."""
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
    }


def final_energies(recording: Recording) -> dict[str, float] | None:
    """Return where the work of the blade went by the last frame [J]; None without an audit."""
    if not recording.is_audited:
        return None
    names = ("work_of_blade_j", *ACCOUNT)
    return {name.removesuffix("_j"): float(recording.column(name)[-1]) for name in names}


def shares(recording: Recording, wall_seconds: float) -> dict[str, float]:
    """Return which fraction of the wall time each stage took; `other` is the rest."""
    total = wall_seconds if wall_seconds > 0.0 else 1.0
    share = {stage: float(recording.column(name).sum()) / total for stage, name in STAGES.items()}
    return share | {"other": 1.0 - sum(share.values())}


def versions() -> dict[str, str]:
    """Return what the figures depend on besides the settings."""
    found = {name.replace("-", "_"): version(name) for name in PACKAGES}
    return found | {"python": platform.python_version(), "platform": platform.platform()}
