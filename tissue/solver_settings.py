"""Settings by which a tissue is cut and moved, whatever it is made of."""

from dataclasses import dataclass, field

from tissue.cut_settings import CutSettings
from tissue.integrators.methods import IntegratorOptions

MASS_SCALING_FREQUENCY = 5800.0
"""Angular frequency above which nodes get mass [1/s]: up to it two steps of the Nystroem method or
four of Verlet are stable in a millisecond. In an organ of 5,000 elements cut in two that is 0.3 %
of its mass. At 5,000 it is 1 %, and shows in the force (1.2 % of its peak); at 6,000 a step more is
taken."""

ELEMENTS = ("averaged", "plain")
"""Ways in which tetrahedra are strained by the motion of their nodes."""

PRECISIONS = ("double", "single")
"""Precisions in which forces of tetrahedra can be computed."""


@dataclass(frozen=True)
class SolverSettings:
    """Method of cutting, integrator, and what they may cost.

    Errors in a setting are raised by `Tissue`, which knows the material and the machine.
    """

    scheme: str = "stellar"
    """Scheme of cutting: `stellar`, or `paper` for that of Bielser, Maiwald and Gross, with its
    limits (`tissue.cutting.bielser_1998`)."""
    cut: CutSettings = field(default_factory=CutSettings)
    """Closeness of cuts to the blade, where the scheme lets one choose."""
    relaxation: str | IntegratorOptions = "global"
    """Method of motion: `global`, all nodes together by a Runge-Kutta-Nystroem method;
    `verlet`, all nodes by position Verlet, up to 1.5 times as fast; `hierarchical`, near the blade
    more often; `paper`, the same as printed, with nodes far from the blade that do not move; or one
    of their classes with settings."""
    mass_scaling: float | None = MASS_SCALING_FREQUENCY
    """Angular frequency [1/s] above which nodes get mass: those of slivers that a cut has left, and
    those that strain or the blade makes as fast, so that a few nodes do not set the time step;
    None: no mass is added. The added mass has no weight, and
    `CutReport.now.added_mass` says how much it is. For the laws of tetrahedra; where the elements
    of the uncut body are faster, their frequency is the limit."""
    element: str = "averaged"
    """Strain of tetrahedra under the laws of solids: `averaged`, a share of the shear by
    gradients averaged around nodes (`tissue.elasticity.averaged_shear`), so that coarse meshes
    bend and twist as a solid; or `plain`, each by itself. Volume is averaged around nodes either
    way. Under the law `springs` these carry the shear, and both are the same."""
    precision: str = "double"
    """Precision in which the forces of tetrahedra are computed: `double`, or `single`, which takes
    two thirds of the time. Positions and velocities are double either way."""
    threads: int = 1
    """Number of threads that share the loops over the body. The result is the same to the last bit;
    with the relaxation `global` or `verlet`. More than one pays only where no other program needs
    the cores: the others look for work for 1 ms at a time before they sleep."""
    audit: bool = False
    """Whether to keep an account of the energy (`StepResult.energies`), for the relaxations
    `global` and `verlet`."""
