"""What the arms of a scene hold, how it is led, and how it acts on the tissue."""
