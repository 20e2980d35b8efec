"""What stands in the world of an arm beside it."""

from typing import Protocol

import mujoco


class Standing(Protocol):
    """An arm, a table, a fixture: anything that can be put into a model."""

    def stand_in(self, spec: mujoco.MjSpec) -> str:
        """Stand it in the world of a model that is yet to be compiled.

        Returns:
            What it is called there, where the model may have had its usual name: the name of its
            geom or body, or what the names of its parts begin with.
        """
