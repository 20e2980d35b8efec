"""Strain and stress at the nodes of the body, for pictures."""
