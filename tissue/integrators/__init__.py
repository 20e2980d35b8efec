"""Methods that advance the motion of the body: the relaxation (RX) of the paper's Table 1."""
