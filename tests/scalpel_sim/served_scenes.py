"""A scene whose tissue is served over TCP, and what of a run must then be the same."""

import threading
from contextlib import closing, contextmanager

import numpy as np

from bridge import TcpLink
from bridge.tcp.server import TissueServer
from scalpel_sim.output.recording import COLUMNS
from scalpel_sim.scene_body import make_tissue

N_TIMES = 6
"""Columns of wall times, the last of `COLUMNS`."""


@contextmanager
def served(scene):
    """Yield a link to the tissue of a scene, which a thread of this process serves."""
    server = TissueServer(lambda: make_tissue(scene), scene=scene.name, port=0)
    threading.Thread(target=server.run, daemon=True).start()
    with closing(TcpLink(server.address)) as link:
        yield link


def untimed(recording):
    """Return the rows of a recording without wall times."""
    n = len(COLUMNS)
    return np.delete(recording.rows, slice(n - N_TIMES, n), axis=1)
