"""The command `figure`: draws the paper's figures, and those of the organ and of scenes."""

import json
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from scalpel_sim.runs.console import log_to_stderr, say
from scalpel_sim.runs.options import OUTPUT, PrintOptions

FigureNumber = Annotated[
    Literal[
        10, 11, 12, "organ", "retract", "excise", "taut_incision", "gallbladder", "layers", "tumour"
    ],
    Parameter(
        help="10, 11, 12, organ, retract, excise, taut_incision, gallbladder, layers or tumour."
    ),
]


def figure(
    number: FigureNumber,
    /,
    *,
    output: Annotated[Path | None, Parameter(group=OUTPUT)] = None,
    scheme: str = "stellar",
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Do the cuts of the paper's Figure 10, 11 or 12 and draw them as a PNG; no screen is needed.

    Figure 10: four frames of a cut through 4 x 6 x 4 cells. Figure 11: the mesh in the first and
    the last of them. Figure 12: arbitrary paths through 2 x 2 x 2 and 7 x 7 x 7 cells. organ: two
    frames of a cut through the organ, which is the picture of the README. retract, excise,
    taut_incision, gallbladder, layers, tumour: two moments of the scene of that name, with all
    instruments.

    For example:

    ```console
    scalpel-sim figure 12 --scheme paper --output paper12.png
    ```

    Args:
        number: 10, 11, 12, organ, retract, excise, taut_incision, gallbladder, layers or tumour.
        output: The file [default: figure10.png (11, ...) in this folder].
        scheme: How the mesh is cut: stellar, or paper for the paper's own scheme.
    """
    from scalpel_sim.output.export import check_file
    from scalpel_sim.scene.checks import check_choice
    from tissue import SCHEMES

    path = output or Path(f"figure{number}.png")
    with log_to_stderr(printing):
        check_choice("scheme", scheme, SCHEMES)
        check_file(path, ".png", "--output")
        from scalpel_sim.figures.figures import draw_figure
        from scalpel_sim.runs.prepared_run import load_kernels

        load_kernels(printing)
        if not printing.quiet:
            say(f"cutting and drawing figure {number}: half a minute to a minute")
        drawn = draw_figure(number, path, scheme)
        if printing.json:
            print(json.dumps({"figure": number, "file": str(path)} | drawn._asdict(), indent=2))
        elif not printing.quiet:
            print(f"{path}: {drawn.caption}")
