"""The command `explain`: what acted in one frame of a run, as tables or JSON."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from scalpel_sim.runs.console import log_to_stderr, progress
from scalpel_sim.runs.options import PrintOptions

if TYPE_CHECKING:  # `--help` should not wait for a compiler
    from rich.console import Console

    from scalpel_sim.runs.explanation import Explanation
    from tissue import ActingForce

MOST_ROWS = 12
"""Forces of one kind that a table shows; `--json` has all."""

LEAST_FORCE = 5e-4
"""Force below which a limit has cut off nothing that the sentence reports [N]."""

_MM_PER_M = 1e3

_TITLES = {
    "edge": "Anchors of the edge of the blade",
    "face": "Faces of the blade",
    "back": "Back of the blade",
    "end": "Ends of the blade",
    "fibre": "Fibres around the edge",
    "self-contact": "Contacts of the body with itself",
    "floor": "Floor",
    "geom": "Rigid geoms, mean of the frame",
    "grasper": "Graspers, mean of the frame",
    "attachment": "Attachments, mean of the frame",
    "ligament": "Ligaments, mean of the frame",
    "load": "Loads",
    "support": "Supports",
}
"""Title of the table of each kind, in their order."""


def explain(folder: Path, /, *, at: float, printing: PrintOptions = PrintOptions()) -> None:
    """Print what acted in one frame of a run: why the force is what it is.

    The run is done again from its folder until that frame, or from a checkpoint before it, and
    gives the same bits; what differs from forces.csv is an error. Nothing in the folder changes.
    For example:

    ```console
    scalpel-sim explain out/organ --at 0.35
    ```

    Args:
        folder: What `run` or `view` wrote, also one that was interrupted.
        at: Simulated time at which the frame begins, or that is in it [s], as in forces.csv.
    """
    with log_to_stderr(printing):
        from scalpel_sim.runs.explanation import explanation_of, frame_to_explain
        from scalpel_sim.runs.prepared_run import load_kernels

        asked = frame_to_explain(folder, at)
        load_kernels(printing, asked.scene)
        with progress(at, printing) as advance:
            found = explanation_of(asked, advance)
        if printing.json:
            print(json.dumps(found.as_numbers() | {"sentence": sentence_of(found)}, indent=2))
        elif not printing.quiet:
            from rich.console import Console

            print_explanation(found, Console())


def sentence_of(found: "Explanation") -> str:
    """Return the force on the blade, and what it consists of, in one sentence."""
    from scalpel_sim.runs.explanation import OF_BLADE

    edge, others = found.of_kinds("edge"), found.of_kinds(*OF_BLADE[1:])
    at_edge, pressing, friction = (float(np.linalg.norm(part)) for part in found.parts)
    parts = []
    if edge:
        n_slipping = sum(each.state.startswith("slips") for each in edge)
        parts.append(f"{at_edge:.3g} N at the edge ({n_slipping} of {len(edge)} anchors slip)")
    if others:
        parts += [f"{pressing:.3g} N pressing on the faces", f"{friction:.3g} N friction"]
    text = f"{np.linalg.norm(found.felt.force):.3g} N"
    text += f": {', '.join(parts)}" if parts else ": the blade touches nothing"
    cut_off = float(np.linalg.norm(found.raw.force - found.felt.force))
    if cut_off > LEAST_FORCE:
        text += f"; limits on the path to the arm changed it by {cut_off:.3g} N"
    return text


def print_explanation(found: "Explanation", console: "Console") -> None:
    """Print the sentence, the wrenches, the limits, and a table of each kind of force."""
    from scalpel_sim.runs.explanation import OF_BLADE

    console.print(
        f"frame {found.frame} of {found.scene}, from {found.time:.6g} s: {sentence_of(found)}",
        highlight=False,
        soft_wrap=True,
    )
    for line in _lines_on_bridge(found):
        console.print(line, highlight=False, soft_wrap=True)
    of_blade = found.of_kinds(*OF_BLADE)
    if of_blade:
        console.print(
            f"The forces of the blade are those on the tissue at the end of the frame. They add up "
            f"to {_size_of(of_blade):.4g} N, the wrench there ({np.linalg.norm(found.at_end):.4g} "
            f"N); its mean over the frame is {np.linalg.norm(found.mean):.4g} N.",
            highlight=False,
            soft_wrap=True,
        )
    for kind, title in _TITLES.items():
        forces = found.of_kinds(kind)
        if forces:
            _print_table(title, forces, console)


def _lines_on_bridge(found: "Explanation") -> list[str]:
    """Return lines on what became of the wrench between the tissue and the arm."""
    raw, felt = (
        f"{np.linalg.norm(each.force):.4g} N, {np.linalg.norm(each.torque):.4g} N m"
        for each in (found.raw, found.felt)
    )
    acted = ", ".join(f"{name} {amount:.3g}" for name, amount in found.limits.items()) or "none"
    lines = [f"bridge: {raw} from the tissue, {felt} felt by the arm; limits that acted: {acted}"]
    lines.append("coupling: " + ", ".join(f"{key} {text}" for key, text in found.coupling.items()))
    if not found.answered:
        lines.append("The tissue was not queried in this frame: its forces are of its last answer.")
    return lines


def _print_table(title: str, forces: "list[ActingForce]", console: "Console") -> None:
    """Print the largest forces of one kind, and the sum of the others, in 80 columns."""
    from rich import box
    from rich.table import Table

    table = Table(title=title, title_justify="left", box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    shown = forces[:MOST_ROWS]
    is_edge = forces[0].kind == "edge"
    columns = {
        "force N": [float(np.linalg.norm(each.force)) for each in shown],
        "friction N": [math.nan if is_edge else each.friction for each in shown],
        "slips at N" if is_edge else "limit N": [each.limit for each in shown],
        "stretch mm" if is_edge else "depth mm": [_MM_PER_M * each.depth for each in shown],
    }
    # What is known of none has no column.
    columns = {name: values for name, values in columns.items() if np.isfinite(values).any()}
    for heading in ("name", "state"):
        table.add_column(heading)
    for heading in (*columns, "at mm"):
        table.add_column(heading, justify="right")
    for each, *numbers in zip(shown, *columns.values(), strict=True):
        at = " ".join(f"{_MM_PER_M * part:.1f}" for part in each.point)
        table.add_row(each.name, each.state, *map(_number, numbers), at)
    console.print(table)
    rest = forces[MOST_ROWS:]
    if rest:
        console.print(f"and {len(rest)} more, together {_size_of(rest):.4f} N\n", highlight=False)


def _size_of(forces: "list[ActingForce]") -> float:
    """Return the size of the sum of forces [N]."""
    return float(np.linalg.norm(sum(each.force for each in forces)))


def _number(value: float) -> str:
    """Return a number for a table; nothing where there is none."""
    return f"{round(value, 4) + 0.0:.4f}" if math.isfinite(value) else ""  # no negative zero
