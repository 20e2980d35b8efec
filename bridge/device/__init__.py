"""A device that drives the blade of a run over TCP: its messages, its client, and the run's end."""
