"""The state of a tissue, to which it can be put back: what it is, and its form in bytes."""
