"""The command `crtk`: clients of ROS 2 drive the blade of a run by the topics of CRTK."""

from functools import partial
from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from bridge import DEFAULT_DEVICE_PORT, DEFAULT_HOST
from scalpel_sim.errors import UsageError
from scalpel_sim.runs.console import log_to_stderr, say
from scalpel_sim.runs.options import CONNECTION, SERVER_PATIENCE, PrintOptions


def crtk(
    address: str = f"{DEFAULT_HOST}:{DEFAULT_DEVICE_PORT}",
    /,
    *,
    name: str = "PSM1",
    rate: float = 200.0,
    key: Annotated[Path | None, Parameter(group=CONNECTION)] = None,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Serve the blade of a run as an arm of ROS 2, with the topics and states of CRTK.

    Clients of the da Vinci Research Kit and of its simulators drive it: servo_cp, move_cp,
    measured_cp, measured_cf, state_command and others, below /NAME. It waits two minutes for a run
    that still gets ready, and ends with it. It needs ROS 2 with crtk_msgs.

    For example:

    ```console
    scalpel-sim run organ --arm psm --hand device
    scalpel-sim crtk --name PSM1
    ros2 topic echo /PSM1/measured_cf
    ```

    Args:
        address: HOST:PORT of the run.
        name: Namespace of the topics.
        rate: How often the arm is led and published [1/s], from 50 to 1000.
        key: File with the key of the run [default: the key in SCALPEL_SIM_KEY, if that is set].
    """
    with log_to_stderr(printing):
        from bridge import DeviceClient, chosen_key
        from scalpel_sim.crtk.crtk_arm import CrtkArm
        from scalpel_sim.crtk.ros_node import load_ros, spin

        # A run releases a blade for which no pose has come for 40 ms.
        if not 50.0 <= rate <= 1000.0:
            raise UsageError(f"--rate is {rate:g}; it must be from 50 to 1000 a second")
        if not name.isidentifier():
            raise UsageError(f"--name is {name!r}; ROS takes letters, digits and underscores")
        ros, secret = load_ros(), chosen_key(key)
        connect = partial(DeviceClient, address, period=1.0 / rate, key=secret)
        arm = CrtkArm(connect(patience=SERVER_PATIENCE), connect)
        try:
            if not printing.quiet:
                say(f"the blade is /{name} of ROS 2, {rate:g} times a second")
            spin(ros, arm, name, rate)
        finally:
            arm.close()
