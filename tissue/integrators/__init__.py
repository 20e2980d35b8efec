"""Relaxation (RX in the paper's Table 1): methods that advance the motion of the body.

- `integrator`: what an integrator does, and which one a user's `options` stand for.
- `system`, `step_context`: what takes part in a step, for Python and for kernels.
- `global_stepper`: the default, all nodes together; `runge_kutta`, `stages` and `stability` are its
  method, `threaded` and `audited` take its steps on several threads and with an account of energy.
- `step_end`: contact and slip of the blade after a step.
- `local`, `hierarchical`: local time stepping, and the paper's section 5.2; both search
  `node_rings` around a `focus`.
- `equilibrium`: the state of rest of a body, by dynamic relaxation.
"""
