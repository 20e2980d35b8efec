"""Benchmarks that anyone can repeat from a clone: `python -m benchmarks NAME`.

`__main__` lists them by name. Each is a function that returns a `BenchmarkResult`; `timing` is the
timer, `scalpel_sim.validate.speed` holds the format of what is measured and the tables. `engine`
alone calls the engine's inner loops. `peers` runs other engines; `studies` judge, and time
nothing.
"""
