"""Faults that are injected into a running simulation are found in the frame in which they act.

Each case takes a simulation to a random frame before, in or after its cut, writes a number into it,
and does some frames: the fault is repaired by repeating the step, or it ends the run by its name.
"""

import functools
from dataclasses import replace

import numpy as np
import pytest

from bridge import CouplingError
from scalpel_sim import SCENES, Simulation, prepare
from scalpel_sim.arm.arm import ARMS, ArmError
from scalpel_sim.arm.blade import BladeError
from scalpel_sim.scene.scene import changed
from tests.support import faults
from tests.support.battery import battery
from tissue import TissueError, Wrench

INSTANTS = (0.2, 0.5, 0.7, 1.0)
"""Instants at which faults come, as shares of the stroke: before, in and after the cut."""

N_AFTER = 5
"""Frames that are done after a fault."""

SETTINGS = (
    ("grid2", "global", "springs", True),
    ("grid2", "verlet", "neo_hookean", False),
    ("slab", "global", "neo_hookean", True),
)
"""Scenes in which faults come, their relaxation and law, and whether energy is accounted for."""
WHERE = (*faults.IN_TISSUE, "load", "wrench", "pose", "speed", "push on the arm", "long step")
NAMED = (TissueError, CouplingError, ArmError, BladeError)
LIMITS = ARMS["touch"]


@functools.cache
def simulation_at(scene, relaxation, law, audit, share):
    """Return a simulation that has done a share of its stroke, and its state."""
    ratio = 0.25 if law == "springs" else 0.45
    material = replace(SCENES[scene].material, law=law, poisson_ratio=ratio)
    of = changed(SCENES[scene], relaxation=relaxation, material=material, audit=audit)
    simulation = prepare(of)
    simulation.run(share * simulation.duration)
    return simulation, simulation.save_state()


class Spoilt:
    """A link whose next step does something else: once it is asked."""

    def __init__(self, simulation: Simulation):
        self._link, self._step = simulation.link, simulation.link.step
        self.seconds = 1.0
        self.force = None
        simulation.link.step = self

    def __call__(self, sweep, dt, *others):
        result = self._step(sweep, dt * self.seconds, *others)
        if self.force is not None:
            result = result._replace(
                wrench=Wrench(self.force, result.wrench.torque, result.wrench.point)
            )
        self.seconds, self.force = 1.0, None
        return result

    def restore(self):
        del self._link.step


def spoil(simulation, spoilt, where, value, random):
    """Inject a fault; `spoilt`: the link of the simulation."""
    data, tissue = simulation.arm.data, simulation.link.tissue
    if where in faults.IN_TISSUE:
        faults.inject(tissue, where, value, random)
    elif where == "load":
        load = tissue.push([random.integers(tissue.n_nodes)], (0.0, 0.0, 0.0))
        load.forces[0, random.integers(3)] = value
    elif where == "wrench":
        spoilt.force = np.zeros(3)
        spoilt.force[random.integers(3)] = value
    elif where == "pose":
        data.qpos[random.integers(len(data.qpos))] = value
    elif where == "speed":
        data.qvel[random.integers(len(data.qvel))] = value
    elif where == "push on the arm":
        data.xfrc_applied[simulation.arm.blade.body_id, random.integers(6)] = value
    else:
        spoilt.seconds = 20.0


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@battery(n_per_change=30, n_long=10_000)
def test_a_fault_is_repaired_or_ends_the_run_by_name_in_its_frame(case):
    random = np.random.default_rng(case)
    settings = SETTINGS[random.integers(len(SETTINGS))]
    simulation, state = simulation_at(*settings, float(random.choice(INSTANTS)))
    simulation.load_state(state)
    tissue, data = simulation.link.tissue, simulation.arm.data
    for _ in range(random.integers(1, 4)):
        simulation.step()
    where, value = random.choice(WHERE), float(random.choice(faults.VALUES))
    n_frames, n_repeated, begun = len(simulation.recording), tissue.n_repeated_steps, data.time
    spoilt = Spoilt(simulation)
    error, n_done = None, 0
    try:
        spoil(simulation, spoilt, where, value, random)
        for _ in range(N_AFTER):
            simulation.step()
            n_done += 1
            felt = simulation.wrench
            assert np.linalg.norm(felt.force) <= LIMITS.force * (1.0 + 1e-9)
            assert np.linalg.norm(felt.torque) <= LIMITS.torque * (1.0 + 1e-9)
            assert np.isfinite(data.qpos).all() and np.isfinite(data.qvel).all()
    except NAMED as caught:
        error = caught
    finally:
        spoilt.restore()
    n, rows = tissue.n_nodes, simulation.recording.rows
    if error is None:
        assert n_done == N_AFTER
        # A stiffness that is another number may be just another material.
        if where in faults.IN_TISSUE and not (where == "stiffness" and np.isfinite(value)):
            assert tissue.n_repeated_steps > n_repeated
    elif where != "load":  # which acts as long as it is there
        assert n_done == 0, f"{where} {value}: found {n_done} frames late: {error}"
    assert np.isfinite(tissue._body.positions[:n]).all()
    assert np.isfinite(tissue._body.velocities[:n]).all()
    assert len(rows) == n_frames + n_done  # each tick once
    times = simulation.recording.column("time_s")
    assert times == pytest.approx(np.arange(len(rows)) * simulation.dt, abs=1e-12)
    assert np.isfinite(data.time) and data.time >= begun
    if error is None or isinstance(error, (TissueError, CouplingError)):
        applied = data.xfrc_applied[simulation.arm.blade.body_id]
        assert np.isfinite(applied).all()
