"""Serves a small block to cut, in a process of its own. Patience is short, for hostile clients.

python serve_block.py [HOST]: the key is the environment's, if it has one.
"""

import sys

import numpy as np

import bridge.peer
from bridge.bridge import Bridge
from bridge.keys import chosen_key
from bridge.link import InProcessLink
from bridge.server import serve
from tissue.blade_shape import BladeShape
from tissue.material import Material
from tissue.shapes import grid
from tissue.tissue import Tissue
from tissue.types import BladeSegment

SIDE = 0.02


def block() -> Tissue:
    """Return a block of 3 x 2 x 2 cells and 2 cm in length, held at its left and right sides.

    The blade is a body and its work is audited, so that a reply has all that one may have.
    """
    mesh = grid((3, 2, 2), (SIDE, SIDE, SIDE))
    fixed = (mesh.positions[:, 0] == 0.0) | (mesh.positions[:, 0] == SIDE)
    return Tissue(mesh, Material(toughness=5.0), fixed=fixed, blade=BladeShape(), audit=True)


def compile_kernels() -> None:
    """Cut a block once, so that no client waits for the compiler."""
    tissue = block()
    bridge = Bridge(InProcessLink(tissue))
    for y in np.linspace(-0.001, 0.01, 100):
        tip, heel = np.array([0.009, y, -0.005]), np.array([0.009, y, 0.025])
        bridge.step(BladeSegment(tip, heel, np.array([0.0, 1.0, 0.0])), 1e-3)
    tissue.surface()
    tissue.chunks()
    tissue.n_pieces()
    tissue.quality()


if __name__ == "__main__":
    compile_kernels()
    bridge.peer.HANDSHAKE_SECONDS = 0.5
    bridge.peer.FRAME_SECONDS = 0.5
    bridge.peer.SEND_SECONDS = 0.5
    serve(
        block,
        scene="block",
        host=(sys.argv[1:] or ["127.0.0.1"])[0],
        port=0,
        key=chosen_key(None),
        on_listening=lambda address: print(address, flush=True),
    )
