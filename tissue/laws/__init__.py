"""The laws of materials: how stress follows from deformation.

In the order in which they are best read:

    law                 the protocol of a law, and the keys of a material's parameters
    mass_spring, ...    one law each
    energy_density      the constants from which kernels compute a law
    kernels             what laws differ in, and the branch between them
"""

from tissue.laws.exponential import Exponential
from tissue.laws.law import Law
from tissue.laws.mass_spring import MassSpring
from tissue.laws.neo_hookean import NeoHookean
from tissue.laws.yeoh import Yeoh

LAWS: dict[str, type[Law]] = {
    kind.name: kind for kind in (MassSpring, NeoHookean, Exponential, Yeoh)
}
"""The laws by name, as `Material`, scenes and files of materials name them. A law of your own is
added by a row: `LAWS[kind.name] = kind`."""
