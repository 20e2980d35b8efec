"""A tetrahedral body that a blade can cut. Tissue frame, SI units."""
