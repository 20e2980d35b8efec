"""Studies of accuracy and of random cases: each prints its findings, and fails on a fault."""
