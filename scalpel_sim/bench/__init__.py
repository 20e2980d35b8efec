"""Benchmarks that anyone can repeat: warm, medians, and what was measured said beside it."""
