"""The command `scalpel-sim check`: what is in the file of a mesh, and how fast it will be cut."""

import json
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from cyclopts import Parameter

from scalpel_sim.cli.options import BodyOptions, MaterialOptions, TissueOptions
from scalpel_sim.cli.scene_options import chosen_scene
from scalpel_sim.runs.console import log_to_stderr
from scalpel_sim.runs.options import PrintOptions

if TYPE_CHECKING:  # `--help` should not wait for a compiler
    from rich.console import Console

    from scalpel_sim.scene.scene import Scene
    from tissue import MeshMeasures, MeshReport

_MM_PER_M = 1e3
_ML_PER_M3 = 1e6
_MS_PER_S = 1e3

_UNITS = {1.0: "metres", 1e-3: "millimetres", 1e-6: "micrometres"}


class Speed(NamedTuple):
    """The time steps that a mesh allows in a material, and how fast it will be cut."""

    time_step: float
    """Longest stable step of the body alone, without a blade [s]."""
    real_time_factor: float | None
    """Factor to expect on this machine, within a factor of two; None where no kernels are there to
    measure it by."""


def check(
    file: Path,
    /,
    *,
    scale: float | None = None,
    material: Annotated[str | None, Parameter(name="--material")] = None,
    printing: PrintOptions = PrintOptions(),
) -> None:
    """Print what is in the file of a mesh, how good its tetrahedra are, and how fast it will be.

    Nothing is cut. Lengths are in millimetres by the unit of the file, which is guessed by the
    extent of the body without `--scale`. The exit code is 2 where the mesh is refused; then what is
    wrong with it is said. For example:

    ```console
    scalpel-sim check liver.msh
    scalpel-sim check liver.msh --scale 0.001 --material liver --json
    ```

    Args:
        file: The mesh: Gmsh, VTK, Medit, TetGen, Abaqus or Nastran.
        scale: Metres in one unit of the mesh file: 0.001 for millimetres.
        material: Material that the time step is for: a name, or a FILE.toml. Without, the soft gel
            that `run --mesh` takes.
    """
    with log_to_stderr(printing):
        from tissue import MeshError, report_on_mesh

        report = report_on_mesh(file, scale)
        speed = None
        if report.fault is None:
            body = BodyOptions(file, report.scale)
            options = TissueOptions(body=body, material=MaterialOptions(material))
            speed = _speed(chosen_scene(None, options, audits=True))
        if printing.json:
            print(json.dumps(_content(file, report, speed), indent=2))
        elif not printing.quiet:
            from rich.console import Console

            print_mesh(file, report, speed, Console(highlight=False))
        if report.fault is not None:
            raise MeshError(f"{file}: {report.fault}")


def _speed(scene: "Scene") -> Speed:
    """Return the time step of a scene's body, and how fast it is cut on this machine."""
    from scalpel_sim.runs.warm_up import KernelSet, kernels_are_compiled
    from scalpel_sim.scene.read import DEFAULT_SCENE, SCENES
    from scalpel_sim.validate.speed.expected import ReferenceFrames, as_run, factor_of_body

    measures = _measures(scene)
    if not kernels_are_compiled(KernelSet.of(as_run(SCENES[DEFAULT_SCENE]))):
        return Speed(measures.time_step, None)
    factor = factor_of_body(ReferenceFrames().seconds(), measures)
    return Speed(measures.time_step, factor)


def _measures(scene: "Scene") -> "MeshMeasures":
    """Return the measures of a scene's body at rest."""
    from tissue import SolverSettings, Tissue

    solver = scene.solver
    settings = SolverSettings(
        scheme=solver.scheme,
        relaxation=solver.relaxation,
        element=solver.element,
        precision=solver.precision,
        mass_scaling=solver.mass_scaling or None,
    )
    return Tissue(scene.mesh(), scene.material, solver=settings).cut_report().initial


def _content(file: Path, report: "MeshReport", speed: Speed | None) -> dict[str, Any]:
    """Return all numbers for JSON, in SI units."""
    content = {"file": str(file)} | report._asdict() | {"box": report.box.tolist()}
    if report.shape is not None:
        labels = [each._asdict() for each in report.shape.labels]
        content["shape"] = report.shape._asdict() | {"labels": labels}
    return content | {"speed": None if speed is None else speed._asdict()}


def print_mesh(file: Path, report: "MeshReport", speed: Speed | None, console: "Console") -> None:
    """Print what is in a file, as a table of names and texts.

    Args:
        file: The file.
        report: What is in it.
        speed: How fast it will be cut; None where it cannot be.
        console: Where to print.
    """
    from rich.table import Table

    facts = Table(box=None, show_header=False, pad_edge=False)
    for name, text in (*_facts(file, report), *([] if speed is None else _facts_of_speed(speed))):
        facts.add_row(name, text)
    facts.columns[0].style = "bold"
    console.print(facts, markup=False)


def _facts(file: Path, report: "MeshReport") -> list[tuple[str, str]]:
    """Return what is in a file, a name and a text each."""
    cells = ", ".join(f"{n} {name}" for name, n in report.cells.items())
    size = _MM_PER_M * (report.box[1] - report.box[0])
    low, high = (_MM_PER_M * corner for corner in report.box)
    unit = _UNITS.get(report.scale, f"units of {report.scale:g} m")
    guess = "--scale 1" if report.scale == 1.0 else f"--scale {report.scale:g}"
    facts = [
        ("file", f"{file}: {report.format}"),
        ("contains", f"{report.n_nodes} nodes, {cells}"),
        ("unit", f"{unit}, guessed by its extent: {guess}" if report.scale_is_guessed else unit),
        ("size", f"{_by(size)} mm, from ({_comma(low)}) to ({_comma(high)}) mm"),
    ]
    if shape := report.shape:
        pieces = "1 piece" if shape.n_pieces == 1 else f"{shape.n_pieces} pieces"
        facts += [
            ("body", f"{shape.n_nodes} nodes, {shape.n_tetrahedra} tetrahedra, {pieces}"),
            ("volume", f"{_ML_PER_M3 * shape.volume:.4g} ml"),
            (
                "quality",
                f"least {shape.quality_min:.2g}, median {shape.quality_median:.2g}; 1 is regular",
            ),
            ("altitude", f"{_MM_PER_M * shape.altitude:.3g} mm, the smallest"),
        ]
        facts += [
            (
                f"label {each.label}",
                f"{each.name or 'no name'}: {each.n_tetrahedra} tetrahedra, "
                f"{_ML_PER_M3 * each.volume:.4g} ml",
            )
            for each in shape.labels
        ]
    return facts + [("note", remark) for remark in report.remarks]


def _facts_of_speed(speed: Speed) -> list[tuple[str, str]]:
    """Return how fast a body will be cut, a name and a text each."""
    step = f"{_MS_PER_S * speed.time_step:.3g} ms, the longest that is stable without a blade"
    if speed.real_time_factor is None:
        return [("time step", step), ("real time", "`scalpel-sim warm-up` first: no kernels yet")]
    factor = f"{_rounded(speed.real_time_factor)} times as fast as real time, within a factor of 2"
    return [("time step", step), ("real time", factor)]


def _rounded(number: float) -> str:
    """Write a number in two digits."""
    return f"{number:.{max(0, 1 - math.floor(math.log10(number)))}f}"


def _by(numbers: Any) -> str:
    return " x ".join(f"{x:.4g}" for x in numbers)


def _comma(numbers: Any) -> str:
    return ", ".join(f"{x:.4g}" for x in numbers)
