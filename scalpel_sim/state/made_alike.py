"""Whether two simulations were made alike, so that the state of one fits the other."""

import hashlib
from collections.abc import Mapping
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from tissue import StateError

if TYPE_CHECKING:
    from scalpel_sim.simulation import Simulation


def settings_of(simulation: "Simulation") -> dict[str, str]:
    """Return what decides how a simulation goes on, beside its state and its tissue, by names.

    The tissue knows its own settings. The stroke of a hand is none: it is led anew.
    """
    model = simulation.arm.model
    compiled = np.empty(mujoco.mj_sizeModel(model), np.uint8)
    mujoco.mj_saveModel(model, None, compiled)
    frame = simulation.frame
    return {
        "MuJoCo": mujoco.__version__,
        "the arm": _digest(compiled),
        "where the tissue lies": repr((frame.origin.tolist(), frame.rotation.tolist())),
        "the stroke": "recorded" if simulation.stroke.is_led else _digest(simulation.stroke.path),
        "the motions of graspers": repr(
            [
                "recorded" if each.motion.is_led else repr(each.motion.waypoints)
                for each in simulation.graspers
            ]
        ),
        "the columns of the recording": _digest(
            np.frombuffer(",".join(simulation.recording.columns).encode(), np.uint8)
        ),
        **simulation.coupled,
    }


def expect_alike(simulation: "Simulation", settings: Mapping[str, str]) -> None:
    """Refuse the state of a simulation that was not made alike.

    Args:
        simulation: Where the state is to be loaded.
        settings: Those of the simulation whose state it is.

    Raises:
        StateError: the message says what differs.
    """
    ours = settings_of(simulation)
    names = sorted(name for name in {*ours, *settings} if ours.get(name) != settings.get(name))
    if names:
        raise StateError(
            f"the state is of another simulation: what differs is {', '.join(names)}. Load it "
            "into one that was made alike"
        )


def _digest(array: np.ndarray) -> str:
    """Return a short text that differs where the bytes of arrays do."""
    return hashlib.blake2b(np.ascontiguousarray(array).tobytes(), digest_size=8).hexdigest()
