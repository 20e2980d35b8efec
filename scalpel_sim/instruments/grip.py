"""A body of a MuJoCo model that holds tissue: its pose leads an attachment, which pulls on it."""

import math
from typing import NamedTuple

import mujoco
import numpy as np
import numpy.typing as npt

from bridge import Bridge, DrivenFrame, TissueFrame
from scalpel_sim.arm.blade import about_centre_of_mass, number_in
from tissue import Attachment, FloatArray, Tissue, Wrench


class GripError(ValueError):
    """The model has no such body, or was handed a wrench that no tissue can exert."""


class _BodyViews(NamedTuple):
    """Views of MuJoCo's arrays for one body: they stay valid for the life of its data."""

    position: FloatArray
    """Origin of the body [m], shape (3,)."""
    axes: FloatArray
    """Axes of the body as columns, shape (3, 3)."""
    centre_of_mass: FloatArray
    """[m], shape (3,)."""
    applied: FloatArray
    """Force [N] and torque [N m] that are applied to it, shape (6,)."""


class Grip:
    """Tissue that a body of a MuJoCo model holds, from where both are now.

    Call `follow` before the step of tissue or bridge and `apply` after it, between `mj_step1` and
    `mj_step2`: there the body is where `qpos` says, and feels the wrench in the same step.

    Args:
        data: Data of a compiled model, for which `mj_kinematics` or a step was called.
        body: The body that holds.
        tissue: What it holds: a tissue in this process, or a bridge to one anywhere.
        where: Which points; see `tissue.Tissue.attach`.
        frame: Where the tissue lies in the world; of a bridge it is that of the bridge.
        stiffness: Total stiffness of the attachment [N/m].
        damping: Total damping of the attachment [N s/m].
        breaks_at: Force at which it breaks [N].

    Raises:
        GripError: the model has no such body.
        ValueError: see `tissue.Tissue.attach`.
        LinkError: the tissue is in another process, and refuses that or did not answer.
    """

    def __init__(
        self,
        data: mujoco.MjData,
        body: str,
        tissue: Tissue | Bridge,
        where: str | npt.ArrayLike,
        *,
        frame: TissueFrame = TissueFrame(),
        stiffness: float,
        damping: float = 0.0,
        breaks_at: float = math.inf,
    ) -> None:
        body_id = number_in(data.model, "body", body, GripError)
        self._data, self._body, self._tissue = data, body_id, tissue
        self._frame = frame = frame_of(tissue, frame)
        self._views: _BodyViews | None = None
        self._of_grip: FloatArray = np.zeros(6)
        self._axes_at_first = self._of_body().axes.copy()
        origin = frame.points_to_tissue(self._of_body().position).tolist()
        numbers = {"stiffness": stiffness, "damping": damping, "breaks_at": breaks_at}
        self.attachment: Attachment | DrivenFrame
        """Attachment of the tissue, in its frame."""
        self.attachment = tissue.attach(where, **numbers, origin=origin)

    def _of_body(self) -> "_BodyViews":
        """Return what MuJoCo knows of the body."""
        if self._views is None:
            data, body = self._data, self._body
            self._views = _BodyViews(
                data.xpos[body],
                data.xmat[body].reshape(3, 3),
                data.xipos[body],
                data.xfrc_applied[body],
            )
        return self._views

    @property
    def n_points(self) -> int:
        """Number of points that it holds; 0 after it was released."""
        return self.attachment.n_points

    @property
    def wrench(self) -> Wrench:
        """Wrench of the tissue on the body in the last step, about the body's origin, world."""
        wrench = self.attachment.wrench
        to_world = self._frame.vectors_to_world
        point = self._frame.points_to_world(wrench.point)
        return Wrench(to_world(wrench.force), to_world(wrench.torque), point)

    def follow(self) -> None:
        """Move the attachment to where the body is, at an even speed in the next step."""
        frame, body = self._frame, self._of_body()
        turned = body.axes @ self._axes_at_first.T  # in the world
        rotation = frame.rotation.T @ turned @ frame.rotation
        self.attachment.move(frame.points_to_tissue(body.position), rotation)

    def apply(self) -> None:
        """Apply the wrench of the last step to the body, besides what others apply to it.

        Raises:
            GripError: the wrench is not finite, or too large; see `body_wrench`. The one of the
                call before stays applied.
        """
        body = self._of_body()
        try:  # zero after the step in which it broke
            now = np.array(about_centre_of_mass(self.wrench, body.centre_of_mass))
        except ValueError as error:
            raise GripError(f"the hold: {error}") from error
        body.applied[:] += now - self._of_grip
        self._of_grip = now

    def release(self) -> None:
        """Release the tissue."""
        if self.n_points:
            self._tissue.release(self.attachment)  # type: ignore[arg-type]  # it is of this one
        self.apply()


def frame_of(tissue: Tissue | Bridge, frame: TissueFrame) -> TissueFrame:
    """Return the frame of a tissue in the world: `frame`, or that of the bridge to it."""
    return tissue.frame if isinstance(tissue, Bridge) else frame
