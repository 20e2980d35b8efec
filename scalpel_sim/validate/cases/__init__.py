"""Cases: experiments of others, described in a TOML file, for `scalpel-sim validate --case`.

runner    assembles the tissue, loads, supports and blade of a case, runs and records it
expected  compares records with a curve or a value
report    table, plot and summary
"""
