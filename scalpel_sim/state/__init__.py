"""The state of a simulation, to which it can be put back."""
