"""`BladeState`: anchors, side contacts, laws and totals, which last from step to step."""

import numpy as np

from tissue.blade.anchors import Anchors
from tissue.blade.blunt_contact import BluntContacts, no_blunt_contacts
from tissue.blade.impulse_totals import ImpulseTotals, new_totals
from tissue.blade.side_contact import SideContacts, new_side_contacts
from tissue.blade.toughness import ToughnessLaw, toughness_law_of
from tissue.blade_shape import BladeShape
from tissue.core.array_types import IntArray
from tissue.core.structs import Arrays
from tissue.material import Material
from tissue.mesh.star import LARGEST_STAR

SEARCH = 512
"""Largest number of tetrahedra that the search beyond a cut face visits."""

REACH = 1.0
"""`BladeState.reach` per mean node size. Further away, a lip that has turned aside would draw the
edge into the tissue behind it."""


class BladeState(Arrays):
    """Everything that the kernels of this package read and write."""

    anchors: Anchors
    """Samples of the cutting edge."""
    sides: SideContacts
    """Faces of the tissue near the side faces of the blade."""
    blunt: BluntContacts
    """Samples of the back and the ends of the blade."""
    toughness: ToughnessLaw
    """Energy that cutting takes."""
    totals: ImpulseTotals
    """Impulses and works."""
    reach: float
    """Distance up to which a sample is anchored beside another one; and up to which a blade that
    backed off still belongs to its anchor [m]."""
    queue: IntArray
    """Scratch for searches, shape (LARGEST_STAR,)."""


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
        sides=new_side_contacts(shape, material, node_size, n_tetrahedra),
        blunt=no_blunt_contacts(),
        toughness=toughness_law_of(material, shape),
        totals=new_totals(),
        reach=float(REACH * node_size),
        queue=np.zeros(max(LARGEST_STAR, SEARCH), dtype=np.int64),
    )
