"""Labels and colours of the energy account, for the table and the picture."""

from typing import NamedTuple


class Term(NamedTuple):
    """A term of the energy account: a field of `tissue.Energies`."""

    name: str
    label: str
    colour: str


# Paul Tol's muted palette, which colour-blind readers can distinguish too.
TERMS = (
    Term("cutting", "cutting: toughness x area", "#cc6677"),
    Term("breaking", "breaking the skin", "#882255"),
    Term("friction", "friction on the blade", "#ddcc77"),
    Term("damping", "damping", "#88ccee"),
    Term("contact", "impacts of the tissue", "#44aa99"),
    Term("topology", "change of the mesh", "#999933"),
    Term("released", "released by the blade, net", "#aa4499"),
    Term("elastic", "stored: elastic", "#117733"),
    Term("held", "stored: at the blade", "#77cc77"),
    Term("kinetic", "stored: motion", "#332288"),
    Term("potential", "stored: height", "#bbbbbb"),
)
"""The terms in the order of the table: first what is dissipated, then what is stored."""
