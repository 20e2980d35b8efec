"""The focus of the relaxation: the nodes that the blade holds (paper, section 5.2)."""

from tissue.anchors import ANCHORED, Anchors
from tissue.body import Body
from tissue.jit import kernel
from tissue.relaxation.breadth_first import Rings, add_focus, begin_search


@kernel
def find_focus(focus: Rings, body: Body, anchors: Anchors) -> bool:
    """Make the nodes that anchors pull on ring 0 of `focus`; return whether there are any.

    Where there are none, `focus` stays as it was. Their order follows from the anchors alone.
    """
    n = 0
    for k in range(len(anchors.state)):
        if anchors.state[k] == ANCHORED:
            if n == 0:
                begin_search(focus)
            n += 1
            for q in range(4):
                add_focus(focus, body.tetrahedra[anchors.tetrahedron[k], q])
    return n > 0
