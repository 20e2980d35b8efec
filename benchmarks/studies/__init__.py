"""Studies that judge, and time nothing: a bar against theory, cuts against their law."""
