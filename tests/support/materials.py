"""Materials that several tests share."""

from tissue import Material

SPRINGS = Material(law="springs", poisson_ratio=0.25)
"""The paper's: springs alone."""
