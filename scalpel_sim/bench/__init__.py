"""`scalpel-sim bench`: benchmarks that anyone can repeat.

`commands` are the commands; `kernels`, `scaling`, `local_frame`, `roofline`, `scenes`, `cut`,
`table1` and `peer_benchmark` each measure one thing; `engine` alone calls the engine's inner
loops. `results` is the format of what was measured, `compare` compares two runs, and `peers` holds
the adapters of other engines.
"""
