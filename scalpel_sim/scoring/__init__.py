"""The score of a run against a plan: the same for a script, a hand, a device and a policy."""
