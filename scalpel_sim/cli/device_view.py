"""Shows a run whose blade a device leads, as the command `view` asks for it."""

from scalpel_sim.cli.console import print_report, say, stay_while
from scalpel_sim.cli.device_run import check_device_options, device_run, perform_device
from scalpel_sim.cli.options import DeviceOptions, PageOptions
from scalpel_sim.cli.run_setup import RunOptions, prepared_run
from scalpel_sim.errors import RunError
from scalpel_sim.output.plot_process import Plotter
from scalpel_sim.viewer.messages import PageControls
from scalpel_sim.viewer.pictures import into_viewer, live_state, show_in
from scalpel_sim.viewer.viewer import Viewer


def view_device(
    scene: str | None,
    options: RunOptions,
    page: PageOptions,
    device: DeviceOptions,
    plotter: Plotter,
) -> None:
    """Do the run, and show it in the page, which may pause it, slow it down or end it.

    Args:
        scene: Name of the scene; None for the default one.
        options: What the command line asks for.
        page: What it asks for of the page.
        device: What it asks for of the device.
        plotter: Draws the plots.

    Raises:
        RunError: the viewer has ended before a device came; or as in `perform_device`.
    """
    check_device_options(device, is_led=True)
    with (
        prepared_run(scene, options, relaxation="verlet", is_led=True) as prepared,
        device_run(prepared, device) as led,
        Viewer(
            prepared.simulation.arm.model,
            title=prepared.simulation.title,
            frame=prepared.simulation.frame,
            wireframe=page.wireframe,
            port=page.port,
            views=prepared.scene.views,
            controls=PageControls(led.controls.commands),
        ) as viewer,
    ):
        simulation, controls = prepared.simulation, led.controls

        def show() -> None:
            show_in(viewer, simulation, live_state(controls))

        def check() -> None:
            if not viewer.is_running:
                raise RunError("the viewer has ended before a device took hold of the blade")

        show()
        controls.on_change = show
        controls.on_wait = lambda: show() if viewer.lacks_values else None
        simulation.pictures.append(into_viewer(viewer, lambda: live_state(controls)))
        say(f"live at {viewer.url}")
        summary = perform_device(prepared, options, plotter, led, check)
        show()
        print_report(summary, prepared.folder, options.output.export, options.printing)
        stay_while(lambda: viewer.is_running, f"{viewer.url} stays until Ctrl-C", controls.on_wait)
