"""The command `view`: a run that is shown live in a browser, and may be led there."""

from scalpel_sim.cli.console import log_to_stderr
from scalpel_sim.cli.options import (
    ArmOptions,
    ClientOptions,
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
    ```

    Args:
        scene: What to cut.
    """
    with log_to_stderr(printing), Plotter() as plotter:
        from scalpel_sim.cli.live_session import LiveSession
        from scalpel_sim.cli.run_setup import RunOptions

        options = RunOptions(tissue, arm, client, output, printing)
        with LiveSession(scene, options, page, plotter) as session:
            session.perform()
