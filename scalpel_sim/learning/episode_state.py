"""`EpisodeState`: an episode between two control steps, in memory or as bytes."""

import hashlib
import json
from typing import Any, NamedTuple, Self

import numpy as np

from scalpel_sim.scene.scene import Scene
from scalpel_sim.state import SimulationState
from tissue import StateError

_EPISODE = "episode"
"""Name of the JSON of an episode in the bytes of its simulation."""

_TABLES = ("task", "act", "observe", "vary")
"""Tables of a scene on which an episode depends, besides what its simulation depends on."""


class EpisodeState(NamedTuple):
    """An episode between two control steps; `Episode.save_state` makes it."""

    simulation: SimulationState
    """Arm, coupling and tissue."""
    content: dict[str, Any]
    """The rest, as JSON has it."""

    def to_bytes(self) -> bytes:
        """Return the state as bytes: those of the simulation, with the rest beside them."""
        text = json.dumps(self.content, allow_nan=False).encode()
        return self.simulation.to_bytes({_EPISODE: np.frombuffer(text, np.uint8)})

    @classmethod
    def from_bytes(cls, data: bytes) -> Self:
        """Return the state that `to_bytes` wrote.

        Raises:
            StateError: the bytes are no state of an episode, or not all of one.
        """
        if not isinstance(data, bytes | bytearray | memoryview):
            raise StateError(
                f"a state is bytes of save_state().to_bytes(), not {type(data).__name__}"
            )
        simulation = SimulationState.from_bytes(bytes(data))
        text = simulation.beside(_EPISODE)
        if text is None:
            raise StateError(
                "the state is of a simulation and of no episode: take one of Episode.save_state()"
            )
        return cls(simulation, json.loads(text.tobytes()))

    def expect(self, settings: dict[str, str]) -> None:
        """Refuse to be of an episode with other settings.

        Raises:
            StateError: the message says what differs.
        """
        ours = self.content["settings"]
        names = sorted(name for name in settings if ours.get(name) != settings[name])
        if names:
            raise StateError(
                f"the state is of another task: what differs is {', '.join(names)}. Load it into "
                "an episode of the same scene"
            )


def settings_of(scene: Scene, arm: str) -> dict[str, str]:
    """Return the settings on which the steps after a state depend, by name."""
    tables = {f"[{name}]": repr(getattr(scene, name)) for name in _TABLES}
    digests = {
        name: hashlib.blake2b(text.encode(), digest_size=8).hexdigest()
        for name, text in tables.items()
    }
    return digests | {"arm": arm}


def state_of_generator(rng: np.random.Generator) -> dict[str, Any]:
    """Return the state of a generator, as JSON has it."""
    found: dict[str, Any] = json.loads(
        json.dumps(rng.bit_generator.state, default=lambda array: array.tolist())
    )
    return found


def generator_at(state: dict[str, Any]) -> np.random.Generator:
    """Return a generator that is at a state.

    Raises:
        StateError: NumPy has no such generator.
    """
    kind = getattr(np.random, str(state["bit_generator"]), None)
    if not (isinstance(kind, type) and issubclass(kind, np.random.BitGenerator)):
        raise StateError(f"NumPy has no generator '{state['bit_generator']}'")
    found = kind()
    found.state = state
    return np.random.Generator(found)
