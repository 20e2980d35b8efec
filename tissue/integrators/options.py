"""Options of the integrators that a user can choose."""

from dataclasses import dataclass
from typing import Literal, get_args

from tissue.material import Material

WhenDamped = Literal["step", "stage"]
"""When the damping acts: between steps, or in every stage of them."""

Far = Literal["moved", "frozen"]
"""What becomes of nodes beyond the last ring: `moved` once a frame, or `frozen` (the paper)."""


@dataclass(frozen=True)
class Global:
    """All nodes together, by a Runge-Kutta-Nystroem method of 4th order.

    Raises:
        ValueError: a setting is none that it can have.
    """

    damping: WhenDamped | None = None
    """When the damping acts: between steps (`step`), of first order with a small error, or in every
    `stage`, of fourth order as the elastic motion: that is the paper's method on two levels, with
    steps shorter by a third or more. By default in every stage under law springs, the paper's, and
    between steps under the others."""

    def __post_init__(self) -> None:
        known = get_args(WhenDamped)
        if self.damping is not None and self.damping not in known:
            raise ValueError(f"damping is {self.damping!r}; it must be one of {', '.join(known)}")


@dataclass(frozen=True)
class Verlet:
    """All nodes together, by position Verlet: one evaluation of the forces a step, second order.

    Up to 1.5 times as fast as the Runge-Kutta method. The peak force on the blade differs from
    its by less than a hundredth, the mean over a stroke by up to two.
    """


@dataclass(frozen=True)
class Hierarchical:
    """The paper's hierarchical relaxation (section 5.2), for springs.

    Raises:
        ValueError: a setting is none that it can have.
    """

    updates: int = 64
    """I: steps that the nodes at the tip of the blade, and those along its edge that it holds, take
    in a frame. Where the steps of a ring would be too long for its stiffest node, it takes twice as
    many, or four times, and so on."""
    rings: int = 6
    """Number s_max of the last ring; nodes of ring s, s edges from the tip, take I 2^-s steps."""
    far: Far = "moved"
    """Nodes beyond. Where they are frozen, as the paper prints it, a frame costs what the rings
    cost, however large the body; but what is frozen does not come to equilibrium."""

    def __post_init__(self) -> None:
        if self.far not in get_args(Far):
            raise ValueError(f"far is {self.far!r}; it must be one of {', '.join(get_args(Far))}")
        if self.rings < 0:
            raise ValueError(f"rings is {self.rings}; it must not be negative")
        if self.updates < 1 or self.updates % (1 << self.rings) != 0:
            raise ValueError(
                f"updates is {self.updates} with {self.rings} rings; nodes of the last ring take "
                f"updates / 2^rings steps in a frame, so updates must be a multiple of "
                f"{1 << self.rings}"
            )


IntegratorOptions = Global | Verlet | Hierarchical

BY_NAME: dict[str, IntegratorOptions] = {
    "global": Global(),
    "verlet": Verlet(),
    "hierarchical": Hierarchical(),
}
"""Integrators by name, with their default settings."""


def checked_relaxation(choice: str | IntegratorOptions, material: Material) -> IntegratorOptions:
    """Return the settings that a name stands for, or those given, for a body of that material.

    Raises:
        ValueError: there is no such integrator, or it is not for that material.
    """
    if isinstance(choice, str):
        if choice not in BY_NAME:
            raise ValueError(f"no relaxation is called {choice!r}. Known: {', '.join(BY_NAME)}")
        choice = BY_NAME[choice]
    if not isinstance(choice, IntegratorOptions):
        raise ValueError(
            f"relaxation is {choice!r}; it must be a name ({', '.join(BY_NAME)}), or Global, "
            "Verlet or Hierarchical with settings"
        )
    has_tetrahedra = not material.law.has_springs or material.volume_modulus > 0.0
    if isinstance(choice, Hierarchical) and has_tetrahedra:
        raise ValueError(
            "hierarchical relaxation moves one node at a time, on its springs alone; with law "
            f"{material.law.name} and poisson_ratio {material.poisson_ratio} tetrahedra resist "
            "too. Choose law springs with poisson_ratio 0.25, or relaxation verlet, which is fast "
            "under every law"
        )
    if isinstance(choice, Verlet) and material.stiffens:
        raise ValueError(
            f"relaxation verlet gains energy under law {material.law.name}: beside a blade "
            "elements get many times as stiff from one step to the next. Choose relaxation global, "
            "which does not, or law neo_hookean"
        )
    return choice
