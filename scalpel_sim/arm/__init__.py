"""The robot arm, its scalpel, and the virtual hand that leads it."""
