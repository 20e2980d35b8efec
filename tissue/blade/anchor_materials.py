"""The numbers of the material that each anchor of the edge is in, or of the layer it follows."""

from tissue.blade.edge_anchors import FREE, Anchors, anchor_modulus
from tissue.blade.toughness import SKIN, TOUGHNESS, ToughnessLaw
from tissue.core.jit import kernel
from tissue.mesh.body import Body
from tissue.mesh.interfaces import NO_LAYER


@kernel
def is_in_other_material(anchors: Anchors, body: Body, law: ToughnessLaw) -> bool:
    """Return whether an anchor has come into tissue of another material, or to or from a layer."""
    if len(law.relative) == 1:
        return False
    for k in range(len(anchors.state)):
        if anchors.state[k] != FREE:
            for i in range(4):
                if anchors.relative[k, i] != _number(anchors, body, law, k, i):
                    return True
    return False


@kernel
def take_material(anchors: Anchors, body: Body, law: ToughnessLaw, k: int) -> None:
    """Write the numbers of the material that anchor `k` is in."""
    for i in range(4):
        anchors.relative[k, i] = _number(anchors, body, law, k, i)
    anchors.stiffness[k] = anchor_modulus(anchors, k) * anchors.length[k]


@kernel
def _number(anchors: Anchors, body: Body, law: ToughnessLaw, k: int, column: int) -> float:
    """Return a number of the material that anchor `k` is in; see `ToughnessLaw.relative`.

    Of a layer it is the toughness per area that the edge sweeps. There is as much more of the layer
    as that is turned against the blade. A skin that is tougher than the tissue is so over a layer
    too.
    """
    row = body.material[anchors.tetrahedron[k]]
    number: float = law.relative[row, column]
    layer, cosine = anchors.layer[k], anchors.layer_cosine[k]
    if layer == NO_LAYER or cosine == 0.0 or column > SKIN or law.toughness == 0.0:
        return number
    along = (body.interfaces.toughness[layer] + law.blunt[row]) / cosine
    if column == TOUGHNESS:
        return along / law.toughness  # type: ignore[no-any-return]
    has_skin = number * law.skin_toughness > law.relative[row, TOUGHNESS] * law.toughness
    return number if has_skin else along / law.skin_toughness
