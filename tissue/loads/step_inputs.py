"""`StepInputs`: what acts on a body in one step from outside, so that the step can be repeated."""

from typing import Any, NamedTuple

from tissue.core.array_types import FloatArray, IntArray
from tissue.core.three_vectors import BladeSweep
from tissue.integrators.model import TissueModel
from tissue.loads.attachment_list import AttachmentList
from tissue.loads.load import Loads


class StepInputs(NamedTuple):
    """What a step begins with that is not in the body: references to what is never written."""

    sweep: BladeSweep | None
    """Motion of the blade."""
    dt: float
    """Length of the step [s]."""
    forces: tuple[FloatArray, ...] = ()
    """Forces of the loads on their points [N]."""
    frames: tuple[tuple[Any, ...], ...] = ()
    """Where the frames of attachments go."""
    geoms: tuple[FloatArray, FloatArray, IntArray] | None = None
    """Where geoms go, and which of them may be touched; None where there are none."""
    supports: FloatArray | None = None
    """Velocities of the fixed nodes [m/s]; None where all stand still."""


def inputs_of(
    sweep: BladeSweep | None,
    dt: float,
    loads: Loads,
    attachments: AttachmentList,
    system: TissueModel,
) -> StepInputs:
    """Return what acts on a body in the next step.

    Args:
        sweep: Motion of the blade.
        dt: Length of the step [s].
        loads: Those of the body.
        attachments: Those of the body.
        system: The body, geoms and supports.
    """
    geoms, supports, body = system.geoms, system.supports, system.body
    if not (loads.act or attachments.act or geoms.geoms or supports.is_moving):
        return StepInputs(sweep, dt)
    return StepInputs(
        sweep,
        dt,
        loads.forces if loads.act else (),
        tuple([each.way for each in attachments.all]) if attachments.act else (),
        geoms.target if geoms.geoms else None,
        body.velocities[: body.n_nodes][body.fixed[: body.n_nodes]] if supports.is_moving else None,
    )


def give_inputs(
    inputs: StepInputs, loads: Loads, attachments: AttachmentList, system: TissueModel
) -> None:
    """Give a body what acts on it in a step, as `inputs_of` found it."""
    loads.forces = inputs.forces
    for each, way in zip(attachments.all, inputs.frames, strict=True):
        each.way = way
    if inputs.geoms is not None:
        system.geoms.target = inputs.geoms
    is_moving = inputs.supports is not None
    if is_moving or system.supports.is_moving:
        body = system.body
        fixed = body.fixed[: body.n_nodes]
        body.velocities[: body.n_nodes][fixed] = inputs.supports if is_moving else 0.0
    system.supports.is_moving = int(is_moving)
