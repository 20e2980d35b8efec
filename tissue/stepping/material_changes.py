"""A change of the materials of a body, between two steps."""

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from tissue.blade.edge import NOWHERE
from tissue.body_materials import chosen, scaled
from tissue.core.array_types import IntArray
from tissue.mesh.material_table import OF_ELASTICITY, MaterialArrays
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
    table, all_rows = scaled(body.materials, rows, mask, factors)
    stages.take_edge(None)
    if table.is_alike(body.materials) and np.array_equal(all_rows, rows):
        body.materials.take(table)
    else:
        _replace_materials(stages, table, all_rows)
    _follow_materials(stages, is_elastic=not OF_ELASTICITY.isdisjoint(factors))


def _replace_materials(stages: StepStages, table: MaterialArrays, rows: IntArray) -> None:
    """Give the body another table of materials.

    Args:
        stages: The body, and all that follows its materials.
        table: The materials.
        rows: Row of each tetrahedron, shape (n_tets,).
    """
    model = stages.model
    # A state that was saved before keeps the memory of then: how much of it was in use is counted
    # in the struct of the body, which is another one from now on.
    for owner in stages.owners:
        owner.grow(len(model.body.rest), len(model.body.tetrahedra))
    model.body.material[: model.body.n_tetrahedra] = rows
    model.body = model.body.replaced(materials=table)


def _follow_materials(stages: StepStages, *, is_elastic: bool) -> None:
    """Make all that follows from the materials of the body; the account of energy begins again.

    Nodes keep their places and velocities; masses and moduli are those of the new materials.

    Args:
        stages: The body, with its new materials; the blade has let go of it.
        is_elastic: Whether forces inside the body, or masses, are others.
    """
    model = stages.model
    model.materials_changed(is_elastic=is_elastic)
    stages.integrator.body_moved(model.body)
    stages.audit.begin(stages.context, NOWHERE)
