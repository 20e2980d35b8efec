import numpy as np, time
from tests.tissue.kernels_of import network_of
from tests import bodies
from tissue.relaxation.breadth_first import *
from tissue.relaxation.hierarchical import *
from tissue.tissue import NOWHERE
from tissue.runge_kutta import runge_kutta_nystroem
import sys

n = int(sys.argv[1])
from tissue.shapes import grid

mesh = bodies.jittered_grid(n, 0)
net = network_of(mesh, bodies.sides(mesh), 2e-4, 8.0)
body, springs = net.body, net.springs
N = len(body.rest)
w = np.sqrt(springs.frequency_squared[:N].max())
g = np.array([0, 0, -9.81])
for _ in range(0):
    pass
dt = 1.5 / w


def glob(T):
    for _ in range(int(T / dt)):
        runge_kutta_nystroem(
            body, springs, net.anchors, NOWHERE, net.stages, g, 2e-4, 8.0, 0.0, dt, 0.0, 1.0
        )


glob(4.0)
xg = body.positions.copy()
print("res", abs(net.stages.a1).max(), "sag", (body.rest - xg)[:, 2].max())
focus = int(np.argmin(np.linalg.norm(mesh.positions - [0.02, 0.02, 0.04], axis=1)))
for smax, I, frozen, wd in [
    (2, 4, True, 1.0),
    (4, 16, True, 1.0),
    (6, 64, False, 1.0),
    (4, 16, False, 1.0),
    (4, 16, False, 2.0),
    (12, 4096, False, 1.0),
]:
    body.positions[:] = body.rest
    body.velocities[:] = 0
    rings = new_rings(N)
    tr = new_trails(N)
    ext = np.zeros((N, 3))
    DT = wd / w
    m = int(3 / DT)
    t = time.time()
    if I > 1000:
        m //= 20
    for _ in range(m):
        begin_search(rings)
        add_focus(rings, focus)
        search(rings, springs, smax + 1)
        hierarchical_frame(
            body,
            springs,
            net.anchors,
            NOWHERE,
            rings,
            tr,
            ext,
            g,
            2e-4,
            8.0,
            0.0,
            DT,
            0.0,
            1.0,
            I,
            smax,
            frozen,
        )
    print(
        smax,
        I,
        frozen,
        wd,
        "err rel",
        abs(body.positions - xg).max() / abs(xg - body.rest).max(),
        "us/frame",
        (time.time() - t) / m * 1e6,
        rings.state[0],
        rings.ring[:N].max(),
    )
