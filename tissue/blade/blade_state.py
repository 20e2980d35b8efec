"""`BladeState`: anchors, side contacts, laws and totals, which last from step to step."""

from typing import NamedTuple

import numpy as np

from tissue.blade.edge_anchors import Anchors
from tissue.blade.faces_contact import FaceContacts, new_face_contacts
from tissue.blade.spine_contact import SpineContacts, no_spine_contacts
from tissue.blade.toughness import ToughnessLaw, toughness_law_of
from tissue.blade_shape import BladeShape
from tissue.core.array_types import FloatArray, IntArray
from tissue.core.jit import inlined, kernel
from tissue.core.simd_rows import natural
from tissue.core.structs import Arrays, FloatCell
from tissue.core.vec3 import Vec3, cross, dot, scale, sub
from tissue.material import Material
from tissue.mesh.body import Body
from tissue.mesh.star import LARGEST_STAR


class ImpulseTotals(Arrays):
    """Impulses that blade and tissue gave each other in this time step, and the work so far."""

    work_of_blade: FloatCell
    """Work of the blade on the tissue [J]."""
    work_of_cutting: FloatCell
    """Toughness times area cut [J]."""
    work_of_breaking: FloatCell
    """Energy that breaking the skin took beyond that of the area cut [J]."""
    work_of_friction: FloatCell
    """Energy that sliding along the side faces of the blade took [J]."""
    released: FloatCell
    """Stored energy of anchors and contacts that ended, less that of those that began [J]."""
    cutting_of_labels: FloatArray
    """`work_of_cutting` in each label of the body [J]; no numbers where it has one."""
    impulse: FloatArray
    """Impulse of the tissue on the blade in this time step [N s], shape (3,)."""
    angular_impulse: FloatArray
    """Impulse of the tissue's torque on the blade about the origin [N m s], shape (3,)."""
    impulse_on_tissue: FloatArray
    """Impulse of the blade on the nodes, summed over them [N s], shape (3,)."""


def new_totals() -> ImpulseTotals:
    """Return totals of zero."""
    return ImpulseTotals(
        work_of_blade=0.0,
        work_of_cutting=0.0,
        work_of_breaking=0.0,
        work_of_friction=0.0,
        released=0.0,
        cutting_of_labels=np.zeros(0),
        impulse=np.zeros(3),
        angular_impulse=np.zeros(3),
        impulse_on_tissue=np.zeros(3),
    )


@kernel
def clear_impulses(totals: ImpulseTotals) -> None:
    """Set the impulses to zero: a time step begins."""
    for c in range(3):
        totals.impulse[c] = 0.0
        totals.angular_impulse[c] = 0.0
        totals.impulse_on_tissue[c] = 0.0


def clear_works(totals: ImpulseTotals) -> None:
    """Set the works to zero: an account of energy begins."""
    totals.work_of_blade = 0.0
    totals.work_of_cutting = 0.0
    totals.work_of_breaking = 0.0
    totals.work_of_friction = 0.0
    totals.released = 0.0
    totals.cutting_of_labels[:] = 0.0


class RunningTotals(NamedTuple):
    """The totals that a loop over forces adds to, kept in registers meanwhile."""

    impulse: Vec3
    """Impulse of the tissue on the blade [N s]."""
    angular_impulse: Vec3
    """Impulse of the tissue's torque on the blade about the origin [N m s]."""
    impulse_on_tissue: Vec3
    """Impulse of the blade on the nodes [N s]."""
    work: float
    """Work of the blade on the tissue [J]."""


@inlined
def running_totals(totals: ImpulseTotals) -> RunningTotals:
    """Return the totals so far."""
    return RunningTotals(
        _vector(totals.impulse),
        _vector(totals.angular_impulse),
        _vector(totals.impulse_on_tissue),
        totals.work_of_blade,
    )


@inlined
def store_totals(totals: ImpulseTotals, running: RunningTotals) -> None:
    """Write the totals after a loop."""
    for c in range(3):
        totals.impulse[c] = running.impulse[c]
        totals.angular_impulse[c] = running.angular_impulse[c]
        totals.impulse_on_tissue[c] = running.impulse_on_tissue[c]
    totals.work_of_blade = running.work


@inlined
def _vector(array: FloatArray) -> Vec3:
    return Vec3(array[0], array[1], array[2])


@inlined
def add_to_node(
    external: FloatArray,
    running: RunningTotals,
    node: int,
    weight: float,
    force: Vec3,
    seconds: float,
) -> RunningTotals:
    """Add a node's share of a force of the blade to the forces on nodes; return the new totals.

    Args:
        external: Forces on the nodes [N], shape (capacity, 3).
        running: Totals so far.
        node: The node.
        weight: Its share of the force.
        force: Force of the blade on the tissue [N].
        seconds: How long the force acts [s].
    """
    row = natural(node)
    external[row, 0] += weight * force.x
    external[row, 1] += weight * force.y
    external[row, 2] += weight * force.z
    before = running.impulse_on_tissue
    on_tissue = Vec3(
        before.x + seconds * weight * force.x,
        before.y + seconds * weight * force.y,
        before.z + seconds * weight * force.z,
    )
    return RunningTotals(running.impulse, running.angular_impulse, on_tissue, running.work)


@inlined
def add_reaction(
    running: RunningTotals,
    at: Vec3,
    force: Vec3,
    displacement: Vec3,
    share: float,
    seconds: float,
) -> RunningTotals:
    """Return the totals with the reaction on the blade to a force on the tissue, and its work.

    Args:
        running: Totals so far.
        at: Where the force acts [m].
        force: Force of the blade on the tissue [N].
        displacement: How far that point of the blade moves in the whole time step [m].
        share: Which share of the time step the force acts for.
        seconds: How long that is [s].
    """
    return RunningTotals(
        sub(running.impulse, scale(seconds, force)),
        sub(running.angular_impulse, scale(seconds, cross(at, force))),
        running.impulse_on_tissue,
        running.work + share * dot(force, displacement),
    )


SEARCH = 512
"""Largest number of tetrahedra that the search beyond a cut face visits."""

REACH = 1.0
"""`BladeState.reach` per mean node size. Further away, a lip that has turned aside would draw the
edge into the tissue behind it."""


class BladeState(Arrays):
    """Everything that the kernels of this package read and write."""

    anchors: Anchors
    """Samples of the cutting edge."""
    sides: FaceContacts
    """Faces of the tissue near the side faces of the blade."""
    spine: SpineContacts
    """Samples of the back and the ends of the blade."""
    toughness: ToughnessLaw
    """Energy that cutting takes."""
    totals: ImpulseTotals
    """Impulses and works."""
    reach: float
    """Distance up to which a sample is anchored next to another one; and up to which a blade that
    backed off still belongs to its anchor [m]."""
    queue: IntArray
    """Scratch for searches, shape (LARGEST_STAR,)."""


@kernel
def count_cutting(blade: BladeState, body: Body, t: int, work: float) -> None:
    """Count work of cutting [J] in tetrahedron `t`, in its label too."""
    totals = blade.totals
    totals.work_of_cutting += work
    if len(totals.cutting_of_labels) > 0:
        totals.cutting_of_labels[blade.toughness.label[body.material[t]]] += work


def new_blade_state(
    anchors: Anchors,
    shape: BladeShape | None,
    material: Material,
    node_size: float,
    n_tetrahedra: int,
) -> BladeState:
    """Return the state of a blade that touches nothing yet.

    Args:
        anchors: Samples of the edge.
        shape: Shape of the blade; None for a line without side faces.
        material: Material of the tissue.
        node_size: Mean node size of the body [m].
        n_tetrahedra: Room for tetrahedra.
    """
    return BladeState(
        anchors=anchors,
        sides=new_face_contacts(shape, material, node_size, n_tetrahedra),
        spine=no_spine_contacts(),
        toughness=toughness_law_of(material, shape),
        totals=new_totals(),
        reach=float(REACH * node_size),
        queue=np.zeros(max(LARGEST_STAR, SEARCH), dtype=np.int64),
    )
