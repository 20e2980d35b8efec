"""Methods that advance the motion of the body: what a user can choose, and a row for each.

Another method that moves all nodes together needs a row and a choice here, its loops in
`tissue.integrators.node_loops`, a file with its step, and a branch in `tissue.integrators.driver`.
"""

from dataclasses import dataclass
from typing import Final, Literal, NamedTuple, get_args

from tissue.laws.law import Law
from tissue.material import Material

RUNGE_KUTTA: Final = 0
"""Number of the Runge-Kutta method on two levels, with damping in every stage."""
NYSTROEM: Final = 1
"""Number of the Nystroem method of three stages."""
VERLET: Final = 2
"""Number of position Verlet."""

UNSHARED: Final = 0
"""The bound on the strained body shares no gradients with a step."""
OF_NEXT_STEP: Final = 1
"""It shares those of the step to come, which begins with an evaluation where the body is."""
OF_LAST_STEP: Final = 2
"""It uses those of the last step, which were evaluated half a step before."""

SAFETY = 0.8
"""Share of the stable step that is used. Springs in strong compression are stiffer than at rest;
0.8 covers a compression to about 0.7 of the rest length. Above 1 the body can explode."""

NYSTROEM_SAFETY = 0.84
"""Share of the stable step of the Nystroem method, which takes energy from fast modes. No account
of the energy sees that: in the organ's stroke it is 0.3 % of the work, with two steps in a
millisecond; at 0.67, with three, it was 0.1 %."""

NYSTROEM_SAFETY_STIFFENING = 0.75
"""The same under laws that stiffen, whose frequencies can double from one bound to the next. The
account needs no less than `NYSTROEM_SAFETY`: cuts in blocks of liver, fat and skin as published
left 0.16, 0.01 and 0.08 % of the work at 0.84, and 0.15, 0.01 and 0.12 % at 0.75."""


class Method(NamedTuple):
    """A method that moves all nodes together."""

    number: int
    """Number by which kernels choose it: its place in `METHODS`."""
    order: int
    """Order of accuracy of the elastic motion."""
    evaluations: int
    """Evaluations of the elastic forces in a step."""
    limit: float
    """Largest angular frequency times step at which it is stable without damping."""
    safety: float
    """Share of the stable step that is used."""
    safety_stiffening: float
    """Share of the stable step that is used under laws that stiffen."""
    damps_between_steps: bool
    """Whether damping acts between steps; if not, in every stage of them."""
    gradients: int
    """Which evaluation of the forces shares its gradients with a bound on the strained body."""
    follows_slivers: bool
    """Whether damping between steps acts as often as slivers need, whose rates are the highest; if
    not, as often as the uncut body needs."""


METHODS: dict[str, Method] = {
    "runge_kutta": Method(
        RUNGE_KUTTA,
        order=4,
        evaluations=3,
        limit=2.587,
        safety=SAFETY,
        safety_stiffening=SAFETY,
        damps_between_steps=False,
        gradients=UNSHARED,
        follows_slivers=True,
    ),
    "nystroem": Method(
        NYSTROEM,
        order=4,
        evaluations=3,
        limit=3.464,  # sqrt(12)
        safety=NYSTROEM_SAFETY,
        safety_stiffening=NYSTROEM_SAFETY_STIFFENING,
        damps_between_steps=True,
        gradients=OF_NEXT_STEP,
        # Where a tip pierces gel its account of energy would be three times as far off if not.
        follows_slivers=True,
    ),
    "verlet": Method(
        VERLET,
        order=2,
        evaluations=1,
        limit=2.0,
        safety=SAFETY,
        safety_stiffening=SAFETY,
        damps_between_steps=True,
        gradients=OF_LAST_STEP,
        follows_slivers=False,
    ),
}
"""Methods by their names, in the order of their numbers."""

WhenDamped = Literal["step", "stage"]
"""When the damping acts: between steps, or in every stage of them."""

Far = Literal["moved", "frozen"]
"""Fate of nodes beyond the last ring: `moved` once a frame, or `frozen` (the paper)."""


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
    many, or four times, and so on; a frame that takes `updates` steps is as printed."""
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

RELAXATIONS: dict[str, IntegratorOptions] = {
    "global": Global(),
    "verlet": Verlet(),
    "hierarchical": Hierarchical(),
    "paper": Hierarchical(updates=64, rings=5, far="frozen"),
}
"""Names of relaxations, with the integrators that they stand for in their default settings; `paper`
is the hierarchy as printed, with an I and an s_max for which no ring of the paper's block takes
more steps than equation 7 says, in frames of 1 ms."""


def checked_relaxation(choice: str | IntegratorOptions, material: Material) -> IntegratorOptions:
    """Return the settings that a name stands for, or those given, for a body of that material.

    Raises:
        ValueError: there is no such integrator, or it is not for that material.
    """
    if isinstance(choice, str):
        if choice not in RELAXATIONS:
            raise ValueError(f"no relaxation is called {choice!r}. Known: {', '.join(RELAXATIONS)}")
        choice = RELAXATIONS[choice]
    if not isinstance(choice, IntegratorOptions):
        raise ValueError(
            f"relaxation is {choice!r}; it must be a name ({', '.join(RELAXATIONS)}), or Global, "
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
            f"relaxation verlet gains energy under law {material.law.name}: near a blade elements "
            "get many times as stiff from one step to the next. Choose relaxation global, which "
            "does not, or law neo_hookean"
        )
    return choice


def method_of(options: IntegratorOptions, law: Law) -> Method:
    """Return the method of a choice; where not all nodes move together, Runge-Kutta.

    That one then moves all nodes where a body settles.
    """
    if isinstance(options, Verlet):
        return METHODS["verlet"]
    usual = "stage" if law.has_springs else "step"
    if isinstance(options, Global) and (options.damping or usual) == "step":
        return METHODS["nystroem"]
    return METHODS["runge_kutta"]
