"""An upright edge, longer than the body, that faces along y."""

from tests.support import bodies
from tests.tissue.kernels_of import cut_of
from tissue.cutting.blade_path import put_on_lattice


def put_edge(cut, x: float, ahead: float = 0.5, low: float = -1.0) -> None:
    """Place the edge at `x` and y = `ahead`, from z = `low` up; its side +1 is towards +x."""
    path = cut.path
    path.t1[:] = [[x, ahead, low], [x, ahead, 2.0]]
    path.t0[:] = path.t1 - [0.0, 1.0, 0.0]
    path.forward[:] = [0.0, 1.0, 0.0]
    path.sideways[:] = [1.0, 0.0, 0.0]
    path.member[:] = True
    path.linked[0] = True
    put_on_lattice(path, cut.body.lattice)


def corner(x: float, **edge):
    """Return the corner of a unit cube with the edge at `x`; for `edge` see `put_edge`."""
    cut = cut_of(bodies.unit_tetrahedron())
    put_edge(cut, x, **edge)
    return cut
