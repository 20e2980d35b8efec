"""A change of the materials of a body, between two steps."""

from tissue.blade.edge import NOWHERE
from tissue.core.array_types import IntArray
from tissue.mesh.material_table import MaterialArrays
from tissue.stepping.stages import StepStages


def change_materials(stages: StepStages, table: MaterialArrays, rows: IntArray) -> None:
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
