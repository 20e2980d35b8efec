"""Action and reaction: what the blade feels is what the tissue gets, in every step."""

import itertools
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from scalpel_sim.validate.block import MIDDLE, block_tissue, edge, rubber
from scalpel_sim.validate.findings import Findings, Known, Line, Scene
from tissue import BladeSegment, BladeShape, BladeSweep, FloatArray, Law, Tissue

_LARGEST = 1e-9
"""[N] and [N m]: the issue's bound."""
_DT = 1e-4
"""Time step [s]: short, since the motion itself keeps moments only as well as it is stepped."""
_SPEED = 0.3
"""[m/s]."""
HEAVY = 4000.0
"""Density [kg/m3]: a free block of water would be pushed away and not cut."""
MESH_TURNS = Known(
    0.0,
    1e-3,
    "where a cut puts nodes in, mass moves between nodes: that keeps mass and momentum to the last "
    "bit, but the centre of mass goes a little, and angular momentum with it: by some 1e-8 N m s, "
    "in one step of a hundred. It is not between blade and tissue",
)


class Balance(NamedTuple):
    """What is left over of action and reaction in each step."""

    forces: FloatArray
    """On the blade and on the tissue, added up [N]; shape (n,)."""
    momentum: FloatArray
    """Force on the blade, and change of the nodes' momentum over time [N]; shape (n,)."""
    moment: FloatArray
    """The same of torque and angular momentum [N m]; shape (n,)."""
    contacts: FloatArray
    """Torque of the contacts and of the wrench at the end of the step [N m]; shape (n,)."""
    mesh_changed: FloatArray
    """Whether nodes were put in, shape (n,)."""
    largest: tuple[float, float]
    """Force [N] and torque about the origin [N m] that there were."""


def wavy(n: int) -> list[BladeSegment]:
    """Return a way through the block that swings from side to side: side load."""
    y = -0.003 + _SPEED * _DT * np.arange(n)
    return [edge((MIDDLE + 0.003 * np.sin(75.0 * at), at, -0.005)) for at in y]


def cut(law: Law, n: int) -> Balance:
    """Cut a block that nothing holds, without drag: all that changes its motion is the blade."""
    material = rubber(law, toughness=10.0, blade_friction=0.3)
    material = replace(material, viscous_damping=0.0, density=HEAVY)
    tissue = block_tissue(material, held="", blade=BladeShape())
    return balance(tissue, wavy(n))


def balance(tissue: Tissue, places: list[BladeSegment]) -> Balance:
    """Lead the blade, and keep what is left over in each step."""
    rows, largest = [], np.zeros(2)
    momentum, moment = _momenta(tissue)
    size = (tissue.n_nodes, tissue.n_tetrahedra, 0.0)
    for t0, t1 in itertools.pairwise(places):
        result = tissue.step(BladeSweep(t0, t1), _DT)
        wrench, contacts = result.wrench, result.contacts
        torque = wrench.torque + np.cross(wrench.point, wrench.force)
        before, (momentum, moment) = (momentum, moment), _momenta(tissue)
        pushes = contacts.normal_force[:, None] * contacts.normal + contacts.friction
        turns = np.cross(contacts.point - wrench.point, pushes).sum(axis=0)
        size_before, size = size, (result.n_nodes, result.n_tetrahedra, result.cut_area)
        rows.append(
            (
                np.abs(wrench.force + result.force_on_tissue).max(),
                np.abs(wrench.force + (momentum - before[0]) / _DT).max(),
                np.abs(torque + (moment - before[1]) / _DT).max(),
                np.abs(turns + result.wrench_t1.torque).max(),
                size != size_before,
            )
        )
        largest = np.maximum(largest, [np.abs(wrench.force).max(), np.abs(torque).max()])
    columns = np.array(rows, dtype=np.float64).T
    forces, of_momentum, of_moment, of_contacts, mesh_changed = columns
    most = (float(largest[0]), float(largest[1]))
    return Balance(forces, of_momentum, of_moment, of_contacts, mesh_changed, most)


def _momenta(tissue: Tissue) -> tuple[FloatArray, FloatArray]:
    """Return momentum [kg m/s] and angular momentum about the origin [kg m2/s]."""
    now = tissue.snapshot()
    each = now.masses[:, None] * now.velocities
    return each.sum(axis=0), np.cross(now.positions, each).sum(axis=0)


def judge(law: str, found: Balance) -> list[Line]:
    """Return the lines of a run."""
    changed = found.mesh_changed > 0.0
    in_steady = float(found.moment[~changed].max())
    in_changed = float(found.moment[changed].max(initial=0.0))
    return [
        Line(f"{law}: force on blade + on tissue", float(found.forces.max()), 0.0, _LARGEST, "N"),
        Line(f"{law}: force on blade + change of momentum", float(found.momentum.max()), 0.0,
             _LARGEST, "N"),
        Line(f"{law}: torque + change of angular momentum", in_steady, 0.0, _LARGEST, "N m"),
        Line(f"{law}: the same where the mesh changes", in_changed, 0.0, _LARGEST, "N m",
             known=MESH_TURNS),
        Line(f"{law}: torque of contacts + wrench", float(found.contacts.max()), 0.0, _LARGEST,
             "N m"),
    ]  # fmt: skip


def measure(quick: bool) -> Findings:
    """Cut a free block under both laws, with friction and side load."""
    lines, notes = [], []
    laws: tuple[Law, ...] = ("neo_hookean",) if quick else ("neo_hookean", "springs")
    for law in laws:
        found = cut(law, 600 if quick else 1500)
        lines += judge(law, found)
        force, torque = found.largest
        notes.append(
            f"{law}: up to {force:.3f} N and {torque:.4f} N m in {len(found.forces)} steps; the "
            f"mesh changed in {int(found.mesh_changed.sum())} of them"
        )
    return Findings(lines, notes=notes)


SCENE = Scene(
    name="reaction",
    title="Action and reaction",
    about=(
        "A block that nothing holds is cut along a wavy line by a scalpel with friction. In each "
        "step of 0.1 ms the force and the torque on the blade are compared with what the nodes of "
        "the block got: the change of their momentum and angular momentum, which knows nothing of "
        "the blade. An arm that feels something else than the tissue gets is not in balance."
    ),
    measure=measure,
)
