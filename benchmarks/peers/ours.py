"""This project's own steps, for the same rounds as the peers."""

from protocol import Body, Stepper, main

from scalpel_sim.bench.engine import Loops
from scalpel_sim.version import version


def make(body: Body, case: str) -> Stepper:
    """Return the block of that size; `case` is LAW:METHOD:DAMPING, and :plain where it is."""
    law, method, damping, *plain = case.split(":")
    is_damped, is_averaged = damping == "damped", not plain
    loops = Loops(len(body.tetrahedra), law, is_damped=is_damped, is_averaged=is_averaged)
    steps = {"runge_kutta": loops.runge_kutta_steps, "euler": loops.euler_steps}[method]
    return Stepper(steps, lambda: loops.positions, version("scalpel-sim"))


if __name__ == "__main__":
    main(make)
