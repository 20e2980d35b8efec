"""The triangle mesh of a scalpel's blade, drawn in place of the box that models it."""

import mujoco
import numpy as np

from scalpel_sim.viewer.primitives import faceted
from scalpel_sim.viewer.triangle_mesh import TriangleMesh
from tissue import FloatArray

_MARGIN = 0.1
"""Distance by which heel and tip may lie outside the box that stands for the blade, as a fraction
of its length. A box that they do not fit is another part of the same body."""

#      spine_start ____________ spine_end
#                 |            \___
#                 |                \___
#            heel |____________________\ tip        sharp along heel-tip, no. 11 blade
#
SPINE_LENGTH = 0.45
"""Length of the blunt back of a no. 11 blade up to its slope, in lengths of the edge."""


def edge_in_geom(model: mujoco.MjModel, geom: int) -> tuple[FloatArray, FloatArray] | None:
    """Return heel and tip [m] in a box's frame, if the box is the sheet that carries them."""
    matrix = np.empty(9)
    mujoco.mju_quat2Mat(matrix, model.geom_quat[geom])
    ends = []
    for name in ("heel", "tip"):
        site = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_SITE, name)
        if site < 0 or model.site_bodyid[site] != model.geom_bodyid[geom]:
            return None
        ends.append((model.site_pos[site] - model.geom_pos[geom]) @ matrix.reshape(3, 3))
    heel, tip = ends
    size = model.geom_size[geom]
    fits = (np.abs([heel, tip]) <= size + _MARGIN * size.max()).all()
    is_in_sheet = np.abs(tip - heel).argmax() != size.argmin() and not np.array_equal(heel, tip)
    return (heel, tip) if fits and is_in_sheet else None


def blade(size: FloatArray, heel: FloatArray, tip: FloatArray) -> TriangleMesh:
    """Return a thin sheet ground to an edge from heel to tip, as wide as the box it stands for.

    Args:
        size: Half sizes of the box [m]; the least is half the thickness of the sheet.
        heel: End of the edge nearest the handle [m], in the box's frame.
        tip: Sharp end [m], in the box's frame.
    """
    along = tip - heel
    across = np.cross(np.eye(3)[np.argmin(size)], along)
    across /= np.linalg.norm(across)
    towards_spine = -across if np.dot(across, heel + tip) > 0.0 else across
    width = 2.0 * float(np.abs(towards_spine) @ size)
    half = np.cross(along, towards_spine)
    half *= size.min() / np.linalg.norm(half)
    spine_start = heel + width * towards_spine
    spine_end = spine_start + SPINE_LENGTH * along
    corners = np.array(
        [heel, tip, spine_start + half, spine_end + half, spine_start - half, spine_end - half]
    )
    heel_, tip_, start, end, start_, end_ = range(6)
    front = [[heel_, tip_, end], [heel_, end, start]]
    back = [[tip_, heel_, start_], [tip_, start_, end_]]
    rim = [[start, end, end_], [start, end_, start_], [end, tip_, end_], [heel_, start, start_]]
    return faceted(corners, np.array(front + back + rim))
