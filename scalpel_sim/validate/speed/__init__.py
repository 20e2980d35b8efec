"""`scalpel-sim bench`: real time of the scenes, and the paper's Table 1, on this machine.

`measurements` is the format of what is measured, and `tables` prints and compares it: the other
benchmarks, in the folder `benchmarks` of the repository, use both. `machine` describes the machine,
and `expected` says how fast each scene will be on it: `scalpel-sim doctor`.
"""
