"""How many Runge-Kutta steps the frames of a run take: many get a warning, too many are refused."""

import logging

from scalpel_sim.errors import UsageError
from scalpel_sim.simulation import Simulation
from tissue import MANY_SUBSTEPS, MOST_SUBSTEPS

_log = logging.getLogger(__name__)


def check_steps_of_frames(simulation: Simulation) -> None:
    """Refuse frames that take so many Runge-Kutta steps that nothing can end one; warn of many.

    Raises:
        UsageError: a frame takes more than `MOST_SUBSTEPS`.
    """
    measures = simulation.link.cut_report().now
    n_steps = simulation.dt / measures.time_step
    if n_steps <= MANY_SUBSTEPS:
        return
    reason = "elements are small, stiff or light"
    remedy = "Check --scale, or lower --young, or raise --density"
    if measures.undamped_steps(simulation.dt) <= MANY_SUBSTEPS:
        reason = "damping is strong"
        remedy = "Lower viscous_damping or retardation_time of its [material]"
    found = f"a frame takes {n_steps:.4g} Runge-Kutta steps, because the tissue's {reason}"
    if n_steps > MOST_SUBSTEPS:
        raise UsageError(f"{found}; at most {MOST_SUBSTEPS:,} are done. {remedy}")
    _log.warning("%s: the run will take long. %s", found, remedy)
