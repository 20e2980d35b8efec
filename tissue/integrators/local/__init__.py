"""Local time stepping: small elements take substeps, and what is at rest sleeps."""
