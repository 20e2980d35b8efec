"""The command `view`: a run that is shown live in a browser, and may be led there."""

from scalpel_sim.cli.console import log_to_stderr
from scalpel_sim.cli.options import (
    ArmOptions,
    ClientOptions,
    DeviceOptions,
    OutputOptions,
    PageOptions,
    PrintOptions,
    SceneName,
    TissueOptions,
)
from scalpel_sim.output.plot_process import Plotter


def view(
    scene: SceneName = None,
    /,
    *,
    page: PageOptions = PageOptions(),
    tissue: TissueOptions = TissueOptions(),
    arm: ArmOptions = ArmOptions(),
    client: ClientOptions = ClientOptions(),
    device: DeviceOptions = DeviceOptions(),
    output: OutputOptions = OutputOptions(),
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Run at real-time speed, and show the cut live in a browser.

    On a terminal it waits for Enter, so that you can open the page first. Afterwards the page stays
    until Ctrl-C. The motion is advanced by --relaxation verlet, unless you choose another
    or the tissue stiffens.

    For example:

    ```console
    scalpel-sim view
    scalpel-sim view slab --wireframe --port 8080
    scalpel-sim view --hand live
    scalpel-sim view --hand device
    ```

    Args:
        scene: What to cut.
    """
    with log_to_stderr(printing), Plotter() as plotter:
        from scalpel_sim.cli.device_run import check_device_options
        from scalpel_sim.cli.device_view import view_device
        from scalpel_sim.cli.live_session import LiveSession
        from scalpel_sim.cli.run_setup import RunOptions

        options = RunOptions(tissue, arm, client, output, printing)
        if page.hand == "device":
            return view_device(scene, options, page, device, plotter)
        check_device_options(device, is_led=False)
        with LiveSession(scene, options, page, plotter) as session:
            session.perform()
