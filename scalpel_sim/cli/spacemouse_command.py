"""The command `spacemouse`: a SpaceMouse leads the blade of a run."""

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from bridge import DEFAULT_DEVICE_PORT, DEFAULT_HOST
from scalpel_sim.errors import RunError
from scalpel_sim.runs.console import log_to_stderr, say
from scalpel_sim.runs.options import CONNECTION, SERVER_PATIENCE, PrintOptions
from scalpel_sim.runs.stop_signals import loading


def spacemouse(
    address: str = f"{DEFAULT_HOST}:{DEFAULT_DEVICE_PORT}",
    /,
    *,
    key: Annotated[Path | None, Parameter(group=CONNECTION)] = None,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Lead the blade of a run by a SpaceMouse, from another terminal.

    The blade moves and turns while the cap is deflected, along the axes of the world: to the right
    is +x, away from you +y, up +z. The left button releases while it is pressed, the right one ends
    the run. It waits two minutes for a run that still gets ready. It needs
    `pip install scalpel-sim[spacemouse]` and the library hidapi.

    For example:

    ```console
    scalpel-sim view --hand device
    scalpel-sim spacemouse
    ```

    Args:
        address: HOST:PORT of the run.
        key: File with the key of the run [default: the key in SCALPEL_SIM_KEY, if that is set].
    """
    with log_to_stderr(printing):
        try:
            with loading():
                import pyspacemouse
                from easyhid import HIDException
        except ImportError as cause:
            raise RunError(
                "a SpaceMouse is read by pyspacemouse, which cannot be loaded "
                f"({cause}): pip install scalpel-sim[spacemouse]"
            ) from cause
        from bridge import DeviceClient, chosen_key
        from scalpel_sim.hands.spacemouse import SPACEMOUSE_PERIOD, lead_by_spacemouse

        convention = pyspacemouse.AxisConvention.HID_Z_UP
        with pyspacemouse.open(axis_convention=convention) as mouse:
            secret = chosen_key(key)
            with DeviceClient(
                address, period=SPACEMOUSE_PERIOD, key=secret, patience=SERVER_PATIENCE
            ) as client:
                if not printing.quiet:
                    say(f"{mouse.name} leads the blade in {client.description.scene}")
                try:
                    lead_by_spacemouse(client, mouse.read)
                except HIDException as cause:
                    raise RunError(f"the SpaceMouse can no longer be read: {cause}") from cause
