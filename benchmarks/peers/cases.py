"""The cases of `bench peers`: ours, and those of other engines, with what each does differently.

Like is compared with like: springs with springs, and tetrahedra under a hyperelastic law with the
same number of force evaluations.
"""

from typing import NamedTuple


class EngineCase(NamedTuple):
    """A case of this engine or of another."""

    engine: str
    adapter: str
    """Name of the adapter's module in `peers`."""
    case: str
    """The case, as the adapter names it."""
    law: str
    """Law of elasticity, damping, and method."""
    evaluations: str
    """Force evaluations in a step; `-` where the method solves a system instead."""
    differs: str
    """Precision, and other differences."""
    install: str = ""
    """Command that installs the engine."""


OURS_SPRINGS, OURS_SOLID = "springs, Runge-Kutta", "plain neo-Hookean, 1 evaluation"
"""Names of the cases that others are compared with: damped with damped, undamped with undamped."""
UNDAMPED = ", undamped"
"""End of the name of a case without dampers."""
SINGLE = ", single"
"""End of the name of a case whose forces are computed in single precision."""

_RKN, _EULER = "Runge-Kutta-Nystroem", "symplectic Euler"
_AVERAGED = "f64; averaged dilatation"

OURS: dict[str, EngineCase] = {
    OURS_SPRINGS: EngineCase(
        "ours", "ours", "springs:runge_kutta:damped", f"springs, damped; {_RKN}", "3",
        "f64; dampers once a step",
    ),
    OURS_SPRINGS + UNDAMPED: EngineCase(
        "ours", "ours", "springs:runge_kutta:undamped", f"springs, no damping; {_RKN}", "3",
        "f64",
    ),
    "springs, 1 evaluation": EngineCase(
        "ours", "ours", "springs:euler:damped", f"springs, damped; {_EULER}", "1",
        "f64; for comparison only",
    ),
    OURS_SOLID: EngineCase(
        "ours", "ours", "neo_hookean:euler:damped:plain", f"neo-Hookean, damped; {_EULER}", "1",
        "f64; for comparison only",
    ),
    OURS_SOLID + UNDAMPED: EngineCase(
        "ours", "ours", "neo_hookean:euler:undamped:plain",
        f"neo-Hookean, no damping; {_EULER}", "1", "f64; for comparison only",
    ),
    "neo-Hookean, 1 evaluation": EngineCase(
        "ours", "ours", "neo_hookean:euler:damped", f"neo-Hookean, damped; {_EULER}", "1",
        f"{_AVERAGED}; for comparison only",
    ),
    "neo-Hookean, Runge-Kutta": EngineCase(
        "ours", "ours", "neo_hookean:runge_kutta:damped", f"neo-Hookean, damped; {_RKN}", "3",
        f"{_AVERAGED}; dampers once a step",
    ),
    OURS_SOLID + SINGLE: EngineCase(
        "ours", "ours", "neo_hookean:euler:damped:plain:single",
        f"neo-Hookean, damped; {_EULER}", "1", "f32, state in f64; for comparison only",
    ),
    OURS_SOLID + SINGLE + UNDAMPED: EngineCase(
        "ours", "ours", "neo_hookean:euler:undamped:plain:single",
        f"neo-Hookean, no damping; {_EULER}", "1", "f32, state in f64; for comparison only",
    ),
    "neo-Hookean, Runge-Kutta" + SINGLE: EngineCase(
        "ours", "ours", "neo_hookean:runge_kutta:damped:single",
        f"neo-Hookean, damped; {_RKN}", "3",
        "f32, state in f64; averaged dilatation; dampers once a step",
    ),
}  # fmt: skip

_MUJOCO, _NEWTON, _RAPIER = (f"pip install {name}" for name in ("mujoco", "newton", "rapier3d"))
_KIRCHHOFF = "St. Venant-Kirchhoff"

PEERS: dict[str, EngineCase] = {
    "MuJoCo flex, Euler": EngineCase(
        "MuJoCo", "mujoco_flex", "Euler:damped", f"{_KIRCHHOFF}, damped; Euler", "1",
        "f64; the whole of mj_step, contact off", _MUJOCO,
    ),
    "MuJoCo flex, Euler" + UNDAMPED: EngineCase(
        "MuJoCo", "mujoco_flex", "Euler:undamped", f"{_KIRCHHOFF}, no damping; Euler", "1",
        "f64; the whole of mj_step, contact off", _MUJOCO,
    ),
    "MuJoCo flex, RK4": EngineCase(
        "MuJoCo", "mujoco_flex", "RK4:damped", f"{_KIRCHHOFF}, damped; Runge-Kutta 4", "4",
        "f64; the whole of mj_step, contact off", _MUJOCO,
    ),
    "MuJoCo flex, discrete": EngineCase(
        "MuJoCo", "mujoco_flex", "discrete:damped", f"{_KIRCHHOFF}, damped; implicit", "-",
        "f64; could take longer steps; contact off", _MUJOCO,
    ),
    "Newton springs": EngineCase(
        "Newton", "newton_semi_implicit", "springs:damped", f"springs, damped; {_EULER}", "1",
        "f32; contact and particle grid off", _NEWTON,
    ),
    "Newton springs" + UNDAMPED: EngineCase(
        "Newton", "newton_semi_implicit", "springs:undamped", f"springs, no damping; {_EULER}",
        "1", "f32; contact and particle grid off", _NEWTON,
    ),
    "Newton neo-Hookean": EngineCase(
        "Newton", "newton_semi_implicit", "neo_hookean:damped",
        f"neo-Hookean, damped; {_EULER}", "1", "f32; contact and particle grid off", _NEWTON,
    ),
    "Rapier springs": EngineCase(
        "Rapier", "rapier_soft", "springs", "distance constraints; 1 iteration", "-",
        "f32; its softness; 1 iteration: its default is 4; collision off", _RAPIER,
    ),
    "Rapier constraints": EngineCase(
        "Rapier", "rapier_soft", "constraints", "neo-Hookean; 1 iteration", "-",
        "f32; could take longer steps; 1 iteration: its default is 4; collision off", _RAPIER,
    ),
    "Rapier finite elements": EngineCase(
        "Rapier", "rapier_soft", "fem", "neo-Hookean; conjugate gradient", "-",
        "f32; could take longer steps; 1 substep: its default is 4; collision off", _RAPIER,
    ),
}  # fmt: skip

LIKE_FOR_LIKE = ("MuJoCo flex, Euler", "Newton neo-Hookean")
"""Cases with one evaluation of a hyperelastic law on tetrahedra, as `OURS_SOLID`."""
