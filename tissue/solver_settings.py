"""How a tissue is cut and moved, whatever it is made of."""

from dataclasses import dataclass, field

from tissue.cut_settings import CutSettings
from tissue.integrators.options import IntegratorOptions


@dataclass(frozen=True)
class SolverSettings:
    """Method of cutting, integrator, and what they may cost.

    Errors in a setting are raised by `Tissue`, which knows the material and the machine.
    """

    scheme: str = "stellar"
    """How the mesh is cut: `stellar`, or `paper` for that of Bielser, Maiwald and Gross, with its
    limits (`tissue.cutting.bielser_1998`)."""
    cut: CutSettings = field(default_factory=CutSettings)
    """How closely cuts follow the blade, where the scheme lets one choose."""
    relaxation: str | IntegratorOptions = "global"
    """How the motion is advanced: `global`, all nodes together; `local`, small elements in substeps
    and what rests asleep; `hierarchical`, the paper's; or `LocalTimeStepping` or `Hierarchical`
    with settings."""
    threads: int = 1
    """How many threads share the loops over the body. The result is the same to the last bit; more
    than one pays from about 30,000 tetrahedra on, and only where no other program needs the
    cores."""
    audit: bool = False
    """Whether to keep an account of the energy (`StepResult.energies`), for a global relaxation. It
    takes about as long as the motion itself, and one thread."""
