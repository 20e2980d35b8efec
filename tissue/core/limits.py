"""Limits of requests to a tissue: the same in a program, in a run and over TCP."""

LARGEST_STRENGTH = 1e9
"""Largest stiffness [N/m], damping [N s/m] and toughness [J/m2] of what holds tissue, far beyond
those of steel: with 1e308 forces are infinite."""

LARGEST_COORDINATE = 1e3
"""Largest coordinate [m]. No body is larger; a blade farther away means an invalid message."""

MANY_SUBSTEPS = 200
"""Steps of the integrator in a frame above which a run will take long. The scenes take 1 to 20."""

MOST_SUBSTEPS = 20_000
"""Steps of the integrator in a time step at most. With the organ they take 5 s, and a signal waits
as long."""
