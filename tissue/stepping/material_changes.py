"""A change of the materials of a body, between two steps."""

from collections.abc import Mapping

import numpy.typing as npt

from tissue.blade.edge import NOWHERE
from tissue.body_materials import chosen, scaled
from tissue.core.array_types import IntArray
from tissue.mesh.material_table import MaterialArrays
from tissue.stepping.given_layers import is_pair, scale_layer
from tissue.stepping.stages import StepStages


def scale_materials(
    stages: StepStages,
    names: Mapping[int, str],
    where: int | str | npt.ArrayLike | None,
    factors: Mapping[str, npt.ArrayLike],
) -> None:
    """Multiply quantities of the materials of some tetrahedra, or of the layer between two labels.

    Args:
        stages: The body, and all that follows its materials.
        names: Names of labels.
        where: See `tissue.Tissue.set_material`, as for `factors`.
        factors: Factors of quantities.

    Raises:
        ValueError: there is no such label, layer or quantity, or a factor makes no sense.
    """
    body = stages.model.body
    if is_pair(where):
        scale_layer(body.interfaces, names, where, factors)
        return
    rows = body.material[: body.n_tetrahedra]
    mask = chosen(body.materials, rows, names, where)
    _change_materials(stages, *scaled(body.materials, rows, mask, factors))


def _change_materials(stages: StepStages, table: MaterialArrays, rows: IntArray) -> None:
    """Make the body of other materials; the blade lets go of it.

    Nodes keep their places and velocities; masses and moduli are those of the new materials, and
    the account of energy begins again.

    Args:
        stages: The body, and all that follows its materials.
        table: The materials.
        rows: Row of each tetrahedron, shape (n_tets,).
    """
    stages.take_edge(None)
    model = stages.model
    # A state that was saved before keeps the memory of then: how much of it was in use is counted
    # in the struct of the body, which is another one from now on.
    for owner in stages.owners:
        owner.grow(len(model.body.rest), len(model.body.tetrahedra))
    model.body.material[: model.body.n_tetrahedra] = rows
    model.take_materials(table)
    stages.integrator.body_moved(model.body)
    stages.audit.begin(stages.context, NOWHERE)
