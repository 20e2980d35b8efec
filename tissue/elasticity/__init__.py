"""Forces inside the body, by law, and the bounds on the frequencies that they cause."""
