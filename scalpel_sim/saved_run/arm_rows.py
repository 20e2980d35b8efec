"""Rows of a step of a recording besides the body: poses, forces, energies."""

import numpy as np
import numpy.typing as npt

from bridge import TissueFrame
from scalpel_sim.recording.columns import force_parts
from scalpel_sim.simulation import Simulation
from scalpel_sim.viewer.model_shapes import body_poses, camera_poses, perspective_cameras
from tissue import Energies, RigidContacts


def poses_and_forces(simulation: Simulation) -> dict[str, npt.ArrayLike]:
    """Return the arm, and the forces on it, after a frame: one row for each field of a step.

    The names are those of `layout.step_fields`. What is not known is NaN: before the first frame
    the parts of the force, and without an audit the energies.
    """
    arm, result = simulation.arm, simulation.bridge.result
    blade = arm.blade.segment()
    parts = np.full(9, np.nan)
    energies = None
    if result is not None:
        forward = simulation.frame.vectors_to_tissue(blade.forward)
        parts = np.concatenate(force_parts(result.contacts_of_blade, forward))
        energies = result.energies
    return {
        "steps/wrench": simulation.wrench.numbers,
        "steps/blade": blade.numbers,
        "steps/poses": body_poses(arm.data),
        "steps/cut_area": 0.0 if result is None else result.cut_area,
        "steps/force_parts": parts,
        "steps/energies": np.full(len(Energies._fields), np.nan) if energies is None else energies,
        "steps/cameras": camera_poses(arm.data, perspective_cameras(arm.model)),
        "steps/grasper_forces": [each.wrench.force for each in simulation.graspers],
    }


def contact_rows(contacts: RigidContacts, frame: TissueFrame) -> npt.NDArray[np.float64]:
    """Return where the tissue acts on the blade [m], and its force there [N]; shape (n, 6).

    Args:
        contacts: Contacts of the blade, tissue frame.
        frame: Pose of the tissue in the world.
    """
    on_tissue = contacts.normal_force[:, None] * contacts.normal + contacts.friction
    return np.hstack([frame.points_to_world(contacts.point), frame.vectors_to_world(-on_tissue)])
