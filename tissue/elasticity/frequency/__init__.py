"""Bounds on the frequencies of nodes, which limit the time step.

In the order in which they are best read:

    at_rest     a bound for tetrahedra at rest
    weights     the same brought near the truth where it is highest
    quick       a wide bound for tetrahedra as they are deformed, a block at a time
    strained    a bound near the truth for them, and mass for nodes that are made fast
    changes     both after a cut, and the mass that nodes get and give back
"""
