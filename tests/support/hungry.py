"""A process that takes two gigabytes where it may have one."""

import numpy as np

from scalpel_sim.meshing.limited_process import limit_memory

if __name__ == "__main__":
    limit_memory(1.0)
    np.ones(250_000_000)
