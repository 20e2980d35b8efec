"""The force that the arm feels: between the tissue's answers, within limits, and passive."""
