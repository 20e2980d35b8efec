"""Relaxation (RX in the paper's Table 1): methods that advance the motion of the body.

In the order in which they are best read:

    methods             a row for each method, and what a user can choose
    integrator          what an integrator does for a tissue
    model               the owners of the arrays that take part in a step
    global_stepper      all nodes together: calls the driver, and makes room for it
    driver              a whole increment in one call: one loop of steps for every method
    step_size           into how many steps an increment is divided
    stability           the largest stable steps
    runge_kutta, nystroem, verlet    one step of each method
    evaluation          all forces at one instant, as each stage evaluates them
    node_loops          the loops over a body that steps consist of
    threads             threads that share these loops
    damping             damping and relaxation of stress between steps
    resting             a body that nothing moves takes no steps
    equilibrium, equilibrium_checks  the state of rest of a body, by dynamic relaxation
    bielser_1998        the paper's hierarchical relaxation (section 5.2)

The forces on nodes are those of `tissue.forces.terms`.
"""
