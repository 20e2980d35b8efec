"""Serves a small block to cut, in its own process, with short timeouts for hostile clients.

Usage: python serve_block.py [HOST]; the key, if there is one, is that of the environment.
"""

import sys

import numpy as np

from bridge import Bridge, InProcessLink, serve
from bridge.tcp import peer
from bridge.tcp.keys import chosen_key
from tissue import BladeSegment, BladeShape, Material, SolverSettings, Tissue, block

SIDE = 0.02


def block_tissue() -> Tissue:
    """Return a block of 3 x 2 x 2 cells and 2 cm in length, held at its left and right sides.

    The blade is a body and energies are audited, so that a reply has all optional parts.
    """
    mesh = block((3, 2, 2), (SIDE, SIDE, SIDE))
    fixed = (mesh.positions[:, 0] == 0.0) | (mesh.positions[:, 0] == SIDE)
    return Tissue(
        mesh,
        Material(toughness=5.0),
        fixed=fixed,
        blade=BladeShape(),
        solver=SolverSettings(audit=True),
    )


def compile_kernels() -> None:
    """Cut a block once, so that no client waits for the compiler."""
    tissue = block_tissue()
    bridge = Bridge(InProcessLink(tissue))
    for y in np.linspace(-0.001, 0.01, 100):
        tip, heel = np.array([0.009, y, -0.005]), np.array([0.009, y, 0.025])
        bridge.step(BladeSegment(tip, heel, np.array([0.0, 1.0, 0.0])), 1e-3)
    tissue.surface()
    tissue.chunks()
    tissue.n_pieces()
    tissue.cut_report()


if __name__ == "__main__":
    compile_kernels()
    peer.HANDSHAKE_SECONDS = 0.5
    peer.FRAME_SECONDS = 0.5
    peer.SEND_SECONDS = 0.5
    serve(
        block_tissue,
        scene="block",
        host=(sys.argv[1:] or ["127.0.0.1"])[0],
        port=0,
        key=chosen_key(None),
        on_listening=lambda address: print(address, flush=True),
    )
