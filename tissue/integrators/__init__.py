"""Relaxation (RX in the paper's Table 1): methods that advance the motion of the body.

- `integrator`: what an integrator does, and which one a user's `options` stand for.
- `model`, `step_context`: what takes part in a step, for Python and for kernels.
- `relaxation`: a whole increment in one call, as `advance` and `step_choice` divide it into steps;
  `staged_relaxation`: the same stage by stage, for methods that do more in between.
- `global_stepper`: all nodes together, by `nystroem` (the default), `runge_kutta` (for springs) or
  `verlet`; `damping` acts between their steps, `substeps` takes them; `node_loops` are run by
  `shared_loops`, which the threads of `threaded` share; `stability` has the largest steps, `losses`
  what contact takes for the account of energy.
- `step_end`: contact and slip of the blade after a step of the others.
- `hierarchical`: the paper's section 5.2, which searches `node_rings` around a `focus`.
- `equilibrium`: the state of rest of a body, by dynamic relaxation.
"""
