"""The stages of a step, and what watches them."""
