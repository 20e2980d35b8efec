"""How the motion of the body is advanced where not every node takes the same step."""
