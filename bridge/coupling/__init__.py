"""What the arm feels of the tissue: between its answers, within limits, without energy from
nothing."""
