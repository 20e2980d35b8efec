"""Writes a commented TOML file with the numbers of a material and of a blade, to start from."""

import textwrap
from pathlib import Path

from scalpel_sim.cli.materials import chosen_presets
from scalpel_sim.cli.new_file import write_new_file
from scalpel_sim.errors import UsageError
from scalpel_sim.scene.blade import SCALPEL
from scalpel_sim.scenes import PHANTOM
from scalpel_sim.tables.toml import SUFFIX
from tissue import BladeShape, Material, Preset, SourcedValue

_WIDTH = 96

MATERIAL_COMMENTS = {
    "law": 'How forces follow from deformation: "springs" along the edges of the mesh, as in the '
    'paper, or tetrahedra: "neo_hookean", or "exponential" or "yeoh", which stiffen as they are '
    "stretched.",
    "young_modulus": "Young's modulus, the stiffness at small strain [Pa].",
    "poisson_ratio": "Poisson's ratio: below 0.5, and 0.25 or more for springs. Soft tissue has "
    "0.45 to 0.49; above 0.49 the time step becomes short.",
    "stiffening": "b of law exponential, 0 under the others: stretched to length 1 + e, tissue is "
    "exp(3 b e^2) times as stiff. Soft organs have 5 to 30.",
    "yeoh_second": "C20 / C10 of law yeoh, 0 under the others.",
    "yeoh_third": "C30 / C10 of law yeoh, 0 under the others.",
    "prony": "Relaxation of stress: g and tau [s] of one to three terms, [[g, tau], ...]; held "
    "tissue keeps 1 - sum of g (1 - exp(-t / tau)) of its stress. []: none relaxes, as under "
    "springs.",
    "density": "Density [kg/m3].",
    "toughness": "Fracture toughness: the energy that a square metre of cut costs [J/m2].",
    "skin_toughness": "Fracture toughness until the edge has broken in [J/m2]: the peak of a "
    "puncture. Less than toughness means no peak.",
    "toughness_exponent": "Exponent n of a toughness that rises with the speed of the cut: "
    "toughness (1 + (speed / toughness_speed)^n). 0: it does not rise.",
    "toughness_speed": "Speed at which toughness is twice that of a slow cut [m/s].",
    "work_to_rupture": "Energy that it takes to stretch a volume until it breaks [J/m3]: what a "
    "blunt edge adds to the toughness.",
    "friction": "Coefficient of friction where cut faces, pieces and the floor touch.",
    "blade_friction": "Coefficient of friction on the faces of the blade.",
    "blade_viscosity": "Shear stress per sliding speed on the faces of the blade [Pa s/m], in "
    "addition to friction.",
    "viscous_damping": "Drag: the rate at which slow motion within the tissue dies away [1/s].",
    "retardation_time": "Viscosity in shear over the shear modulus [s].",
    "spring_calibration": "Stiffness of the springs over that of van Gelder's formula. Keep it at "
    "1, unless the law is springs and they were measured on this mesh.",
}
"""What each key of `[material]` means, in the order of the file."""

BLADE_COMMENTS = {
    "thickness": "Thickness [m]. 0: the blade is a line, as in the paper, and the other numbers "
    "have no effect.",
    "bevel_degrees": "Angle between each bevel and the plane of the blade [degree], at most 60.",
    "height": "Distance from the edge to the back [m].",
    "edge_radius": "Radius of the edge: how blunt it is [m]. A new scalpel has about 1e-6.",
}
"""What each key of `[blade]` means, in the order of the file."""


def write_template(path: Path, name: str | None, *, force: bool = False) -> None:
    """Write a file with the numbers of a material and of a scalpel, and a comment on each.

    Args:
        path: The file; its name ends in .toml.
        name: The material; None for the soft gel of the scenes.
        force: Whether a file that exists is replaced.

    Raises:
        UsageError: there is no such material, another suffix, or the file exists and `force` is
            not given.
        RunError: the system refuses.
    """
    if path.suffix.lower() != SUFFIX:
        raise UsageError(f"--write is {path}; its name must end in {SUFFIX}")
    if name is None:
        text = template(PHANTOM, "the soft gel of the scenes")
    else:
        (preset,) = chosen_presets(name)
        text = template(preset.material, f"{preset.name}, {preset.about}", preset)
    write_new_file(path, text, force=force, instead="another --write")


def template(
    material: Material, about: str, preset: Preset | None = None, blade: BladeShape = SCALPEL
) -> str:
    """Return the text of a file with all numbers of a material and a blade.

    Args:
        material: Gives the numbers of `[material]`.
        about: What material it is, for the first line.
        preset: Gives the sources of its figures; None without.
        blade: Gives the numbers of `[blade]`.
    """
    head = (
        f"Start: {about}, and a scalpel. SI units. Use it with `--material FILE --blade FILE`, or "
        "with one of the two. A key that is left out keeps the value of the scene; an option on "
        "the command line, such as --young, overrides the key."
    )
    lines = [*_comment(head), "", "[material]"]
    for name, comment in MATERIAL_COMMENTS.items():
        lines += _comment(comment)
        figure = getattr(preset, name, None)
        if isinstance(figure, SourcedValue):
            lines += _comment(_origin(figure))
        lines += [f"{name} = {_as_toml(getattr(material, name))}", ""]
    lines.append("[blade]")
    for name, comment in BLADE_COMMENTS.items():
        lines += [*_comment(comment), f"{name} = {_as_toml(getattr(blade, name))}", ""]
    return "\n".join(lines[:-1]) + "\n"


def _origin(figure: SourcedValue) -> str:
    """Return how a figure was measured, and by whom."""
    source = f" [{figure.source}]" if figure.source else ""
    confirmed = "" if figure.is_confirmed else " (an estimate: not traced to a measurement)"
    return f"Value: {figure.measured}{source}{confirmed}"


def _comment(text: str) -> list[str]:
    """Return the lines of a comment."""
    return [f"# {line}" for line in textwrap.wrap(text, _WIDTH, break_on_hyphens=False)]


def _as_toml(value: float | str | tuple[tuple[float, float], ...]) -> str:
    """Return a value as TOML has it; reading it gives the same bits."""
    if isinstance(value, tuple):
        return str([list(term) for term in value])
    return f'"{value}"' if isinstance(value, str) else repr(float(value))
