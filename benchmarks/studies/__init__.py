"""Studies of accuracy and of random cases: each prints what it found, and fails where it is wrong."""
