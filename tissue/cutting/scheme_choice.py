"""The scheme of cutting that a user chose, for a given body."""

from tissue.cut_settings import CutSettings
from tissue.cutting.scheme import Scheme
from tissue.cutting.stellar_scheme import StellarScheme
from tissue.cutting.workspace import SnapLimits
from tissue.mesh.body import Body

LARGEST_CRUMB = 0.125
"""Volume of a crumb at most, as a share of the body's: half of a body of six tetrahedra is none."""


def scheme_of(name: str, cut: CutSettings, body: Body, density: float, node_size: float) -> Scheme:
    """Return the scheme of that name.

    Args:
        name: `stellar` or `paper`.
        cut: How closely cuts follow the blade, where the scheme lets one choose.
        body: The body to be cut; whole.
        density: Mass per volume at rest [kg/m3].
        node_size: Mean node size of the body [m].
    """
    if name == "paper":  # imported late: its kernels would cost every start 0.8 s
        from tissue.cutting.bielser_1998.scheme import PaperScheme

        return PaperScheme(body, density, node_size)
    volume = body.masses.sum() / density
    lengths = SnapLimits(
        snap=float(cut.snap),
        floor=float(cut.floor * node_size),
        guard=float(cut.guard * node_size),
        crumb=float(min(cut.crumb / body.n_tetrahedra, LARGEST_CRUMB) * volume),
    )
    return StellarScheme(lengths, len(body.rest), len(body.tetrahedra))
