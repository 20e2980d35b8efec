"""Action and reaction: in every step the force on the blade is opposite to that on the tissue."""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import CUT_X, block_tissue, edge_at, soft_material
from scalpel_sim.validate.findings import Check, Findings, lines_of
from tissue import BladeSegment, BladeShape, BladeSweep, FloatArray, StepResult, Tissue

_LINES = lines_of("reaction")
_DT = 1e-4
"""Time step [s]: short, since the time integration keeps angular momentum only to an error that
shrinks with the step."""
_FRAME = 1e-3
"""Time step of a haptic loop [s], in which nodes get mass."""
_SPEED = 0.3
"""Speed of the blade [m/s]."""
_DENSITY = 4000.0
"""Density [kg/m3]: a free block as light as water would be pushed away and not cut."""


class Balance(NamedTuple):
    """The imbalance of action and reaction in each step."""

    forces: FloatArray
    """Force on the blade plus force on the tissue [N], shape (n,)."""
    momentum: FloatArray
    """Force on the blade plus the rate of change of the nodes' momentum [N], shape (n,). Here and
    below with the momentum of added mass, and without the impulse of mass scaling."""
    angular_momentum: FloatArray
    """Torque on the blade plus the rate of change of the nodes' angular momentum [N m], shape
    (n,)."""
    contacts: FloatArray
    """Torque of the contacts plus torque of the wrench at the end of the step [N m], shape (n,)."""
    mesh_changed: FloatArray
    """1 where nodes were inserted, else 0, shape (n,)."""
    largest: tuple[float, float]
    """Largest force [N] and largest torque about the origin [N m] of all steps."""
    added: FloatArray
    """Rate of change of the momentum of added mass, less the impulse of mass scaling [N], shape
    (n,)."""


def _wavy_cut(n: int, dt: float) -> list[BladeSegment]:
    """Return `n` poses, `dt` apart, of a cut that swings from side to side: side load."""
    y = -0.003 + _SPEED * dt * np.arange(n)
    return [edge_at((CUT_X + 0.003 * np.sin(75.0 * at), at, -0.005)) for at in y]


def cut_free_block(law: str, n: int, dt: float = _DT, density: float = _DENSITY) -> Balance:
    """Cut a block that nothing holds, without drag: only the blade changes its momentum.

    Args:
        law: Name of the law of elasticity.
        n: Number of poses of the blade.
        dt: Time step [s].
        density: Density [kg/m3].
    """
    material = soft_material(law, toughness=10.0, blade_friction=0.3)
    material = replace(material, viscous_damping=0.0, density=density)
    tissue = block_tissue(material, held="", blade=BladeShape())
    return _balance(tissue, _wavy_cut(n, dt), dt)


def _balance(tissue: Tissue, poses: list[BladeSegment], dt: float) -> Balance:
    """Move the blade from pose to pose; return the imbalance in each step."""
    rows, largest = [], np.zeros(2)
    momenta, added = _momenta(tissue), np.zeros(6)
    size = (tissue.n_nodes, tissue.n_tetrahedra, 0.0)
    for t0, t1 in itertools.pairwise(poses):
        result = tissue.step(BladeSweep(t0, t1), dt)
        wrench, contacts = result.wrench, result.contacts.of_blade
        torque = wrench.torque + np.cross(wrench.point, wrench.force)
        before, momenta = momenta, _momenta(tissue)
        added_before, added = added, _added_momenta(result)
        added_rate = (added - added_before) / dt
        rate = (momenta - before) / dt + added_rate
        on_contacts = contacts.normal_force[:, None] * contacts.normal + contacts.friction
        torque_of_contacts = np.cross(contacts.point - wrench.point, on_contacts).sum(axis=0)
        size_before, size = size, (result.n_nodes, result.n_tetrahedra, result.cut_area)
        rows.append(
            (
                np.abs(wrench.force + result.force_on_tissue).max(),
                np.abs(wrench.force + rate[:3]).max(),
                np.abs(torque + rate[3:]).max(),
                np.abs(torque_of_contacts + result.wrench_t1.torque).max(),
                size != size_before,
                np.abs(added_rate[:3]).max(),
            )
        )
        largest = np.maximum(largest, [np.abs(wrench.force).max(), np.abs(torque).max()])
    columns = np.array(rows, dtype=np.float64).T
    forces, of_momentum, of_angular_momentum, of_contacts, mesh_changed, of_added = columns
    peaks = (float(largest[0]), float(largest[1]))
    return Balance(
        forces, of_momentum, of_angular_momentum, of_contacts, mesh_changed, peaks, of_added
    )


def _momenta(tissue: Tissue) -> FloatArray:
    """Return momentum [N s] and angular momentum about the origin [N m s] of the own mass, (6,)."""
    now = tissue.snapshot()
    each = now.masses[:, None] * now.velocities
    return np.asarray(np.hstack((each, np.cross(now.positions, each))).sum(axis=0))


def _added_momenta(result: StepResult) -> FloatArray:
    """Return those of added mass, less the impulse of mass scaling, shape (6,)."""
    added = result.added_mass
    return np.concatenate(
        (added.momentum - added.impulse, added.angular_momentum - added.angular_impulse)
    )


def check_balance(law: str, found: Balance) -> list[Check]:
    """Return the checks of a cut."""
    changed = found.mesh_changed > 0.0
    columns = {
        "forces": found.forces,
        "momentum": found.momentum,
        "angular_momentum": found.angular_momentum[~changed],
        "changed_mesh": found.angular_momentum[changed],
        "contacts": found.contacts,
    }
    return [
        _LINES[key].check(law, float(column.max(initial=0.0))) for key, column in columns.items()
    ]


def measure_reaction(quick: bool) -> Findings:
    """Cut a free block under both laws, with friction and side load, and once with added mass."""
    checks, notes = [], []
    laws: tuple[str, ...] = ("neo_hookean",) if quick else ("neo_hookean", "springs")
    for law in laws:
        found = cut_free_block(law, 600 if quick else 1500)
        checks += check_balance(law, found)
        force, torque = found.largest
        notes.append(
            f"{law}: up to {force:.3f} N and {torque:.4f} N m in {len(found.forces)} steps; the "
            f"mesh changed in {int(found.mesh_changed.sum())} of them"
        )
    found = cut_free_block("neo_hookean", 60 if quick else 150, _FRAME, 1000.0)
    checks.append(_LINES["added"].check("neo_hookean", float(found.momentum.max())))
    notes.append(
        f"steps of 1 ms, in which nodes get mass: up to {found.largest[0]:.3f} N, of which the "
        f"momentum of the body's own mass lacks up to {found.added.max():.3f} N"
    )
    return Findings(checks, notes=notes)
