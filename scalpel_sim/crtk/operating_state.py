"""The operating states of CRTK, and which command leads from which to which.

After "Robot Meta-States" and the table below it in the documentation of the convention
(Collaborative Robotics Toolkit, crtk-robotics.readthedocs.io).
"""

from typing import Final

DISABLED: Final = "DISABLED"
ENABLED: Final = "ENABLED"
PAUSED: Final = "PAUSED"
FAULT: Final = "FAULT"

_LEADS_TO: Final = {
    (DISABLED, "enable"): ENABLED,
    (DISABLED, "disable"): DISABLED,
    (ENABLED, "enable"): ENABLED,
    (ENABLED, "disable"): DISABLED,
    (ENABLED, "pause"): PAUSED,
    (PAUSED, "disable"): DISABLED,
    (PAUSED, "pause"): PAUSED,
    (PAUSED, "resume"): ENABLED,
    (FAULT, "enable"): ENABLED,
    (FAULT, "disable"): DISABLED,
}
"""State after a command; what is missing is refused."""

COMMANDS: Final = ("enable", "disable", "pause", "resume", "home", "unhome")
"""The commands that a state machine takes."""


class CommandError(ValueError):
    """The arm does not do this in its present state."""


class OperatingState:
    """The operating state of an arm: at first disabled, and not homed."""

    def __init__(self) -> None:
        self.state: str = DISABLED
        """DISABLED, ENABLED, PAUSED or FAULT."""
        self.is_homed = False
        """Whether it has been homed since it was last unhomed."""

    @property
    def is_ready(self) -> bool:
        """Whether it takes commands of motion."""
        return self.state == ENABLED and self.is_homed

    def obey(self, command: str) -> None:
        """Do what a command asks for.

        Raises:
            CommandError: there is no such command, or not in this state.
        """
        if command not in COMMANDS:
            raise CommandError(
                f"there is no state command '{command}'; there are {', '.join(COMMANDS)}"
            )
        if command == "home":
            if self.state != ENABLED:
                raise CommandError(
                    f"it is {self.state}, and is homed when ENABLED: enable it first"
                )
            self.is_homed = True
        elif command == "unhome":
            self.is_homed = False
        elif (self.state, command) in _LEADS_TO:
            self.state = _LEADS_TO[self.state, command]
        else:
            raise CommandError(f"it is {self.state}, in which there is no '{command}'")

    def fail(self) -> None:
        """Note a fault, which lasts until the next `enable` or `disable`."""
        self.state = FAULT

    def expect_ready(self, motion: str) -> None:
        """Refuse a motion of an arm that takes none.

        Raises:
            CommandError: it is not enabled, or not homed.
        """
        if self.state != ENABLED:
            raise CommandError(f"{motion} is refused: it is {self.state}, not ENABLED")
        if not self.is_homed:
            raise CommandError(f"{motion} is refused: it is not homed")
