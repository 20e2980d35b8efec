"""The command `view`: a run that is shown live in a browser, and may be led there."""

from contextlib import AbstractContextManager
from dataclasses import replace
from typing import TYPE_CHECKING

from scalpel_sim.cli.options import ArmOptions, SceneName, TissueOptions, with_values
from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import (
    ClientOptions,
    DeviceOptions,
    OutputOptions,
    PageOptions,
    PrintOptions,
)

if TYPE_CHECKING:  # an error of use should be printed without waiting for a compiler
    from scalpel_sim.hands.commands import Begin, DrawnLine
    from scalpel_sim.runs.prepared_run import PreparedRun
    from scalpel_sim.strokes.kind import StrokeTable


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
    with log_to_stderr(printing):
        from scalpel_sim.cli.run_setup import RunOptions, prepared_run
        from scalpel_sim.runs.device_run import check_device_options
        from scalpel_sim.runs.live_session import LiveSession

        options = RunOptions(tissue, arm, client, output, printing)
        check_device_options(device, is_led=page.hand == "device")

        def prepare(asked: "Begin") -> AbstractContextManager["PreparedRun"]:
            return prepared_run(
                asked.scene or scene,
                options._replace(tissue=_changed(tissue, asked)),
                relaxation="verlet",
                is_led=asked.is_led,
                strokes=[_stroke_along(line) for line in asked.lines],
            )

        with LiveSession(prepare, page, device) as session:
            session.perform()


def _stroke_along(line: "DrawnLine") -> "StrokeTable":
    """Return the stroke along a line that was drawn in the page."""
    from scalpel_sim.strokes.kind import StrokeTable

    points = [(x, y, z) for x, y, z in line.points]
    x, y, z = line.edge
    return StrokeTable(
        kind="traced", points=points, edge=(x, y, z), depth=line.depth, speed=line.speed
    )


def _changed(tissue: TissueOptions, asked: "Begin") -> TissueOptions:
    """Return the options of a run: those of the command line, and the choices in the page."""
    if asked.scene:  # what the command line says of the body is about another scene
        tissue = TissueOptions(solver=tissue.solver)
    material, blade = tissue.material, tissue.blade
    if asked.material is not None:
        material = replace(material, material=asked.material)
    if asked.toughness is not None:
        material = with_values(material, toughness=asked.toughness)
    if asked.blade_thickness is not None:
        blade = with_values(blade, blade_thickness=asked.blade_thickness)
    return replace(tissue, material=material, blade=blade)
